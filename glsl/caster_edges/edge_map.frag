#version 460
// Writes silhouette edges into a map of edge ids by quads: no target, only the atomics. The same map as edge_map.comp.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "edge_map.glsl"

layout(push_constant, scalar) uniform Push {
  ivec2 map_size;
  float reach; // texels before an edge's end or side at which a cell learns of it
} push;

layout(location = 0) flat in uint index;

void main() { insertEdge(index, segments[index], ivec2(gl_FragCoord.xy) + 1, push.map_size, push.reach); }
