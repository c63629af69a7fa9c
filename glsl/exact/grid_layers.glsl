// The layers of triangles between a receiver and the light's centre, from the lists of its cell.
// Include after grid.glsl.
#ifndef EDGESHADE_GRID_LAYERS
#define EDGESHADE_GRID_LAYERS
#include "grid_triangle.glsl"

layout(binding = 6, scalar) readonly buffer Header { ListHeader header; };
layout(binding = 7, scalar) readonly buffer Starts { uint starts[]; };
layout(binding = 8, scalar) readonly buffer Entries { ListEntry entries[]; };
layout(binding = 9, scalar) readonly buffer GridTriangles { GridTriangle grid_triangles[]; };

// Tests the bit of a cell's block among the blocks whose casters found no room.
bool isLost(uint blocks[8], uint cell) {
  uint block = coarseBlock(uvec2(cell % push.cells, cell / push.cells));
  return (blocks[block >> 5] >> (block & 31u) & 1u) != 0;
}

// False for a cell whose triangles found no room.
bool hasTriangles(uint cell) { return starts[cell + 1] <= push.entries && (header.lost == 0 || !isLost(header.lost_blocks, cell)); }

// Number of layers over a receiver, given by ndc and depth; without `all`, at most 1.
uint layersOver(vec3 receiver, uint cell, bool all) {
  uvec3 place = boundedPlace(receiver.xy, receiver.z);
  uint layers = 0, end = starts[cell + 1];
  for (uint block = starts[cell]; block < end && (all || layers == 0); block += 32) {
    // The first loop finds the few triangles that may cover the receiver, from little of their data.
    uint found = 0, size = min(32, end - block);
    for (uint i = 0; i < size; ++i) found |= uint(isBounded(place, entries[block + i].bounds)) << i;
    while (found != 0) {
      uint t = entries[block + uint(findLSB(found))].caster;
      found &= found - 1;
      if (planeDepth(grid_triangles[t].plane, grid_triangles[t].range, receiver.xy) < receiver.z &&
          coversPlace(grid_triangles[t].lines, grid_triangles[t].inner, receiver.xy)) {
        ++layers;
        if (!all) break;
      }
    }
  }
  return layers;
}

#endif
