#version 460
// Draws a quad around each edge: Kenzel, "Edge Distance Shadow Mapping" (2013), section 3.2.2.
#extension GL_GOOGLE_include_directive : require
#include "drawn_edge.glsl"
#include "edge_quad.glsl"

layout(push_constant, scalar) uniform Push {
  uvec2 map_size;
  float half_width; // texels
} push;

void main() { edgeQuad(push.half_width, vec2(0.0), vec2(push.map_size)); }
