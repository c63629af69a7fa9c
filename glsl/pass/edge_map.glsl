// Edge ids in a map: for each texel the K nearest silhouette edges, by 64-bit keys. The high word is the squared distance,
// whose bits order like integers; the low word the segment. An empty slot is greater than every key.
#ifndef EDGESHADE_EDGE_MAP
#define EDGESHADE_EDGE_MAP
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/edge_segment.glsl"
#include "lib/bias.glsl"

layout(constant_id = 0) const int K = 2;       // slots a texel
layout(constant_id = 1) const bool KILL = true; // leave out edges that lie behind everything around a texel
layout(constant_id = 2) const int SPILL = 0;    // edges a texel may have beyond its slots
layout(constant_id = 3) const bool SPLIT = false; // the slots are more than a buffer holds: a second one has the lower half

const uint64_t EMPTY = 0xFFFFFFFFFFFFFFFFul;

// An edge beyond the K nearest of its texel.
struct SpilledEdge {
  uint segment;
  uint next; // entry, or all bits
};

layout(binding = 0) uniform sampler2DArray shadow_map;
layout(binding = 1, scalar) readonly buffer Segments { EdgeSegment segments[]; };
layout(binding = 2, scalar) buffer Keys { uint64_t keys[]; };
layout(binding = 3, scalar) buffer Spill {
  uint lost;  // edges that found no place
  uint count; // entries asked for
  SpilledEdge entries[];
} spill;
layout(binding = 5, scalar) buffer LowerKeys { uint64_t lower_keys[]; };
layout(binding = 4, scalar) buffer Heads { uvec2 heads[]; }; // first entry of a texel, and how many it asked for, less one


// Farthest depth of a texel and its eight neighbours; beyond the map 1.
float farthestAround(ivec2 texel, vec2 map_size) {
  float z = 0.0;
  for (int i = 0; i < 4; ++i) {
    vec4 g = textureGather(shadow_map, vec3(vec2(texel + ivec2(i & 1, i >> 1)) / map_size, 0.0));
    z = max(z, max(max(g.x, g.y), max(g.z, g.w)));
  }
  return z;
}

// An edge that is seen from the light has something farther beside it. Depth over the edge's own length as margin.
bool isHidden(EdgeSegment e, ivec2 texel, vec2 map_size) {
  float t = segmentFoot(e, vec2(texel) + 0.5);
  return segmentDepth(e, t) > farthestAround(texel, map_size) + 2.0 * DEPTH_ULPS;
}

// A texel's other edges hang on a chain, in no order: whoever reads it asks all of them.
void spillEdge(uint segment, uint texel) {
  uint entry = 0xFFFFFFFFu;
  if (SPILL > 0 && atomicAdd(heads[texel].y, 1) + 1 < uint(SPILL)) entry = atomicAdd(spill.count, 1);
  if (entry >= uint(spill.entries.length())) {
    atomicAdd(spill.lost, 1);
    return;
  }
  spill.entries[entry] = SpilledEdge(segment, atomicExchange(heads[texel].x, entry));
}

// Puts an edge into a texel's list if it is near enough. Slots are only ever lowered, and what is displaced moves on to the
// next: whatever the order of the insertions, the slots end with the K smallest keys.
void insertEdge(uint index, EdgeSegment e, ivec2 texel, ivec2 map_size, float radius) {
  float d2 = segmentDistance2(e, vec2(texel) + 0.5);
  if (!(d2 <= radius * radius)) return;
  int half_height = (map_size.y + 1) / 2;
  bool lower = SPLIT && texel.y >= half_height;
  uint index_of_texel = uint(texel.y) * uint(map_size.x) + uint(texel.x);
  uint slot = uint(K) * (index_of_texel - (lower ? uint(half_height) * uint(map_size.x) : 0));
  uint64_t x = uint64_t(floatBitsToUint(d2)) << 32 | uint64_t(index);
  if (KILL && isHidden(e, texel, vec2(map_size))) return;
  for (int k = 0; k < K; ++k) {
    uint64_t old = lower ? atomicMin(lower_keys[slot + k], x) : atomicMin(keys[slot + k], x);
    if (old == x) return;
    x = max(old, x);
    if (x == EMPTY) return;
  }
  spillEdge(uint(x), index_of_texel);
}

#endif
