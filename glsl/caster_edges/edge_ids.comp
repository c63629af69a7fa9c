#version 460
// Picture of a map of edge ids: the nearest edge of each cell in a colour of its id, brighter the nearer it is; black
// without an edge.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "edge_cells.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) readonly buffer Keys { uvec2 keys[]; }; // from edge_map.glsl: segment, squared distance
layout(binding = 1) writeonly uniform image2D picture;

layout(push_constant, scalar) uniform Push {
  ivec2 map_size;
  uint slots;  // per cell
  float reach; // distance in texels up to which a cell holds edges
} push;

const uint EMPTY = 0xFFFFFFFFu;
const float FARTHEST = 0.3; // brightness of an edge that only touches the cell's corner

// A bijection that spreads every bit of its input.
uint scatter(uint x) {
  x = (x ^ x >> 16) * 0x7FEB352Du;
  x = (x ^ x >> 15) * 0x846CA68Bu;
  return x ^ x >> 16;
}

// The brightest channel is 1, and none is below a quarter.
vec3 colorOf(uint id) {
  uint h = scatter(id);
  vec3 c = 85.0 + vec3(h & 255u, h >> 8 & 255u, h >> 16 & 255u);
  return c / max(c.x, max(c.y, c.z));
}

void main() {
  float farthest = 1.41421356 * (0.5 + push.reach);
  ivec2 cell = ivec2(gl_GlobalInvocationID.xy) + 1;
  if (!isCell(cell, push.map_size)) return;
  uvec2 nearest = keys[push.slots * cellIndex(cell, push.map_size)];
  float near = 1.0 - min(sqrt(uintBitsToFloat(nearest.y)) / farthest, 1.0);
  vec3 color = nearest.x == EMPTY ? vec3(0.0) : mix(FARTHEST, 1.0, near) * colorOf(nearest.x);
  imageStore(picture, cell - 1, vec4(color, 1.0));
}
