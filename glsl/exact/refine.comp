#version 460
// Refines pairs of a caster and a block of cells to the 16 blocks or cells inside. On the last level a first dispatch
// counts the casters of each cell, and a second one writes them into the cells' lists.
#extension GL_GOOGLE_include_directive : require
#include "grid.glsl"
#include "grid_triangle.glsl"
#include "grid_edge.glsl"
#include "caster_lists.glsl"

const int TRIANGLES = 0, EDGES = 1;
layout(constant_id = 0) const int CASTERS = TRIANGLES;
layout(constant_id = 1) const int LEVEL = 1;        // of the pairs
layout(constant_id = 2) const bool WRITE = false;   // on level 1: write entries

layout(local_size_x = 64) in;

layout(binding = 3, scalar) readonly buffer GridTriangles { GridTriangle grid_triangles[]; };
layout(binding = 4, scalar) readonly buffer GridEdges { GridEdge grid_edges[]; };
layout(binding = 5, scalar) buffer Counts { uint counts[]; };
layout(binding = 6, scalar) readonly buffer Starts { uint starts[]; };
layout(binding = 7, scalar) writeonly buffer Entries { ListEntry entries[]; };

// A block or cell on the level below that of the pairs.
struct Square {
  vec2 center;
  float half_size;
  float deepest; // greatest depth of its receivers
};

Square squareOf(uvec2 block, uint deepest) {
  float side = 2.0 / float(levelSide(LEVEL - 1));
  // A hundredth of a cell covers the rounding of places.
  return Square((vec2(block) + 0.5) * side - 1.0, 0.5 * side + 0.02 / float(push.cells), orderedFloat(deepest));
}

// Tests whether the caster may matter to the receivers of the square.
bool matters(uint caster, Square s) {
  vec2 range;
  return CASTERS == TRIANGLES ? mayCover(grid_triangles[caster], s.center, s.half_size, s.deepest)
                              : mayReach(grid_edges[caster], s.center, s.half_size, s.deepest, push.kappa, range);
}

// Bounds of the receivers in a cell that the caster may matter to.
uint boundsIn(uvec2 cell, uint caster, Square s) {
  vec2 low, high;
  float nearest;
  if (CASTERS == TRIANGLES) {
    low = grid_triangles[caster].low;
    high = grid_triangles[caster].high;
    nearest = nearestOver(grid_triangles[caster], s.center, s.half_size);
  } else {
    vec2 range;
    mayReach(grid_edges[caster], s.center, s.half_size, s.deepest, push.kappa, range);
    reachOf(grid_edges[caster], range, s.deepest, push.kappa, low, high, nearest);
  }
  vec2 corner = vec2(cell), cells = vec2(push.cells);
  return packBounds((0.5 * low + 0.5) * cells - corner, (0.5 * high + 0.5) * cells - corner, nearest);
}

void refine(uint index) {
  uvec2 pair = pairs[index];
  uint children = pair.y >> 16, kept = 0;
  while (children != 0) {
    uint child = uint(findLSB(children));
    children &= children - 1;
    uvec2 block = 4 * blockOf(pair) + uvec2(child & 3u, child >> 2);
    uint cell = block.y * push.cells + block.x;
    if (WRITE) {
      // The counts fall back to 0 on the way.
      uint at = starts[cell] + atomicAdd(counts[cell], -1) - 1;
      if (at < push.entries) entries[at] = ListEntry(pair.x, boundsIn(block, pair.x, squareOf(block, depths[cell])));
      continue;
    }
    uint deepest = depths[levelStart(LEVEL - 1) + block.y * levelSide(LEVEL - 1) + block.x];
    if (deepest == 0 || !matters(pair.x, squareOf(block, deepest))) continue;
    if (LEVEL > 1) {
      appendPair(LEVEL - 1, packPair(pair.x, block, 0xFFFFu));
    } else {
      atomicAdd(counts[cell], 1);
      kept |= 1u << child;
    }
  }
  if (LEVEL == 1 && !WRITE) pairs[index].y = (pair.y & 0xFFFFu) | kept << 16;
}

void main() {
  uint count = min(LEVEL == 3 ? header.count3 : LEVEL == 2 ? header.count2 : header.count1, push.pairs);
  uint step = 64 * gl_NumWorkGroups.x, first = uint(LEVEL - 1) * push.pairs;
  for (uint i = 64 * gl_WorkGroupID.x + gl_LocalInvocationIndex; i < count; i += step) refine(first + i);
}
