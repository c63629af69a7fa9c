#version 460
// Writes silhouette edges into a map of edge ids by compute: 16 threads walk along an edge, one column of cells at a
// time. caster_edges/edge_map.vert and edge_map.frag make the same map by drawing quads.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "casters.glsl"
#include "edge_map.glsl"

layout(local_size_x = 64) in;

layout(binding = 6, scalar) readonly buffer Header { SilhouetteHeader header; };

layout(push_constant, scalar) uniform Push {
  ivec2 map_size;
  float reach; // cells hold edges up to this many texels away; 0: edges that enter them
} push;

const uint WALKERS = 16; // threads per edge

void walk(uint index, uint walker) {
  EdgeSegment e = segments[index];
  if ((e.flags & SEGMENT_VALID) == 0) return;
  vec2 d = e.b - e.a;
  // The walk follows the longer axis. Across it, the corners of a square are at most (1 + slope) half sides away from
  // the line.
  bool steep = abs(d.y) > abs(d.x);
  vec2 a = steep ? e.a.yx : e.a, b = steep ? e.b.yx : e.b;
  float half_side = 0.5 + push.reach, slope = a.x != b.x ? (b.y - a.y) / (b.x - a.x) : 0.0;
  float across = half_side * (1.0 + abs(slope)) + 1e-3;
  ivec2 last_cell = (steep ? push.map_size.yx : push.map_size) - 1;
  float low = min(a.x, b.x), high = max(a.x, b.x);
  int first = max(int(ceil(low - half_side - 1e-3)), 1), last = min(int(floor(high + half_side + 1e-3)), last_cell.x);
  for (int x = first + int(walker); x <= last; x += int(WALKERS)) {
    float y = a.y + slope * (clamp(float(x), low, high) - a.x);
    int from = max(int(ceil(y - across)), 1), to = min(int(floor(y + across)), last_cell.y);
    for (int i = from; i <= to; ++i) insertEdge(index, e, steep ? ivec2(i, x) : ivec2(x, i), push.map_size, push.reach);
  }
}

void main() {
  uint index = 4 * chunkIndex(gl_WorkGroupID) + gl_LocalInvocationIndex / WALKERS;
  if (index < header.count) walk(index, gl_LocalInvocationIndex % WALKERS);
}
