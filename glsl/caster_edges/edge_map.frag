#version 460
// Writes silhouette edges into a map of edge ids by drawing quads. There is no render target, only atomics.
// edge_map.comp makes the same map.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "edge_map.glsl"

layout(push_constant, scalar) uniform Push {
  ivec2 map_size;
  float reach; // cells hold edges up to this many texels away
} push;

layout(location = 0) flat in uint index;

void main() { insertEdge(index, segments[index], ivec2(gl_FragCoord.xy) + 1, push.map_size, push.reach); }
