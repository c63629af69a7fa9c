// Map of edge ids. Its cells are the squares between four texel centres; cell (i, j) is centred at (i, j), in texels.
// The edges of a point's cell are all the edges that the point can meet on its way to the cell's corners. Each cell
// keeps the edges that enter it. The K nearest to its centre have slots, ordered by 64-bit keys. The high word of a key
// is the squared distance, whose float bits have the same order as integers. The low word is the segment. An empty slot
// is greater than every key.
#ifndef EDGESHADE_EDGE_MAP
#define EDGESHADE_EDGE_MAP
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/edge_segment.glsl"
#include "edge_cells.glsl"
#include "lib/shadow_test.glsl"

layout(constant_id = 0) const int K = 2;       // slots per cell
layout(constant_id = 1) const bool KILL = true; // leave out edges that lie behind everything around the cell
layout(constant_id = 2) const int SPILL = 0;    // largest number of edges of a cell beyond its slots
layout(constant_id = 3) const bool SPLIT = false; // the slots exceed one buffer; a second one holds the lower half

const uint64_t EMPTY = 0xFFFFFFFFFFFFFFFFul;

layout(binding = 0) uniform sampler2DArray shadow_map;
layout(binding = 1, scalar) readonly buffer Segments { EdgeSegment segments[]; };
layout(binding = 2, scalar) buffer Keys { uint64_t keys[]; };
layout(binding = 3, scalar) buffer Spill {
  uint lost;  // number of edges that found no place
  uint count; // number of entries requested
  SpilledEdge entries[];
} spill;
layout(binding = 4, scalar) buffer Heads { uvec2 heads[]; }; // first entry of a cell; number of entries it requested, minus one
layout(binding = 5, scalar) buffer LowerKeys { uint64_t lower_keys[]; };

// Farthest depth of a cell's four texels and of the twelve around them; 1 outside the map.
float farthestAround(ivec2 cell, vec2 map_size) {
  float z = 0.0;
  for (int i = 0; i < 4; ++i) {
    ivec2 corner = cell + ivec2(2 * (i & 1) - 1, 2 * (i >> 1) - 1);
    vec4 g = textureGather(shadow_map, vec3(vec2(corner) / map_size, 0.0));
    z = max(z, max(max(g.x, g.y), max(g.z, g.w)));
  }
  return z;
}

// Tests whether the light cannot see an edge near a cell. An edge that the light sees has something farther beside it.
bool isHidden(EdgeSegment e, ivec2 cell, vec2 map_size) {
  float t = segmentFoot(e, vec2(cell));
  return segmentDepth(e, t) > farthestAround(cell, map_size) + 2.0 * DEPTH_ULPS;
}

// Adds an edge without a slot to the cell's chain. Chains have no order; readers visit every entry.
void spillEdge(uint segment, uint cell) {
  uint entry = 0xFFFFFFFFu;
  if (SPILL > 0 && atomicAdd(heads[cell].y, 1) + 1 < uint(SPILL)) entry = atomicAdd(spill.count, 1);
  if (entry >= uint(spill.entries.length())) {
    atomicAdd(spill.lost, 1);
    return;
  }
  spill.entries[entry] = SpilledEdge(segment, atomicExchange(heads[cell].x, entry));
}

// Inserts an edge into a cell if the edge enters the cell or comes within `reach` of it. Slots only decrease, and a
// displaced key moves on to the next slot. So the slots end with the K smallest keys, whatever the order of insertions.
void insertEdge(uint index, EdgeSegment e, ivec2 cell, ivec2 map_size, float reach) {
  if (!isCell(cell, map_size) || !entersSquare(e, vec2(cell), 0.5 + reach)) return;
  float d2 = segmentDistance2(e, vec2(cell));
  uint index_of_cell = cellIndex(cell, map_size), lower_from = lowerCells(map_size);
  bool lower = SPLIT && index_of_cell >= lower_from;
  uint slot = uint(K) * (index_of_cell - (lower ? lower_from : 0));
  uint64_t x = uint64_t(floatBitsToUint(d2)) << 32 | uint64_t(index);
  if (KILL && isHidden(e, cell, vec2(map_size))) return;
  for (int k = 0; k < K; ++k) {
    uint64_t old = lower ? atomicMin(lower_keys[slot + k], x) : atomicMin(keys[slot + k], x);
    if (old == x) return;
    x = max(old, x);
    if (x == EMPTY) return;
  }
  spillEdge(uint(x), index_of_cell);
}

#endif
