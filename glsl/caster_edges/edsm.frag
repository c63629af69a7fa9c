#version 460
// Writes the signed distance of an edge, and its priority as depth: the depth test keeps the smallest.
#extension GL_GOOGLE_include_directive : require
#include "drawn_edge.glsl"
#include "edsm_distance.glsl"

layout(constant_id = 0) const bool PRINTED = false; // eq. 3.3 as printed
layout(constant_id = 1) const int PRIORITY = SEGMENT;
layout(constant_id = 2) const bool KILL = true; // leave out edges that the light does not see

layout(binding = 0, scalar) readonly buffer Segments { EdgeSegment segments[]; };
layout(binding = 1) uniform sampler2DArray shadow_map;

layout(push_constant, scalar) uniform Push {
  uvec2 map_size;
  float half_width; // texels
} push;

layout(location = 0) flat in uint edge_index;
layout(location = 0) out float signed_distance;

void main() {
  EdgeSegment e = segments[edge_index];
  EdgeDistance r = edgeDistance(e, gl_FragCoord.xy, push.half_width, PRINTED, PRIORITY);
  vec2 foot = mix(e.a, e.b, r.along);
  if (KILL && isHidden(shadow_map, ivec2(push.map_size), e, foot, segmentDepth(e, r.along))) discard;
  signed_distance = r.signed_distance;
  gl_FragDepth = r.priority;
}
