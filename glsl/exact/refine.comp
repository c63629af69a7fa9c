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
layout(binding = 7, scalar) writeonly buffer Entries { uint entries[]; };

// Tests whether the caster may matter to the receivers of a block or cell on the level below that of the pairs.
bool matters(uint caster, uvec2 block, uint deepest_bits) {
  float deepest = orderedFloat(deepest_bits), side = 2.0 / float(levelSide(LEVEL - 1));
  vec2 center = (vec2(block) + 0.5) * side - 1.0;
  // A hundredth of a cell covers the rounding of places.
  float half_size = 0.5 * side + 0.02 / float(push.cells);
  return CASTERS == TRIANGLES ? mayCover(grid_triangles[caster], center, half_size, deepest)
                              : mayReach(grid_edges[caster], center, half_size, deepest, push.kappa);
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
      if (at < push.entries) entries[at] = pair.x;
      continue;
    }
    uint deepest = depths[levelStart(LEVEL - 1) + block.y * levelSide(LEVEL - 1) + block.x];
    if (deepest == 0 || !matters(pair.x, block, deepest)) continue;
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
