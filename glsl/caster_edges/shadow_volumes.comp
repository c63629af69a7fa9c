#version 460
// Visibility by shadow volumes: a point is lit if it is inside none. Crow, "Shadow Algorithms for Computer Graphics"
// (1977), counted beyond the surface (z-fail: Carmack 2000; Everitt, Kilgard 2002).
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "common/shadow_map_test.glsl"

layout(constant_id = 0) const bool BLENDED = false; // counts come from blending; false: from the stencil
layout(constant_id = 1) const bool MASKED = false;  // the shadow map holds casters that have no volumes
layout(constant_id = 2) const bool KEEP_COUNT = false;

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 3) uniform usampler2D stencil;
layout(binding = 4) uniform sampler2D blended;
layout(binding = 5) uniform sampler2DArray shadow_map;
layout(binding = 6) writeonly uniform image2D visibility;
layout(binding = 7) writeonly uniform image2D count_image; // for pictures

layout(push_constant, scalar) uniform Push {
  float normal_offset; // in the shadow map: multiples of the offset that a plane needs
} push;

float visibilityAt(ivec2 pixel, bool in_volume) {
  Receiver r = receiverAt(pixel);
  if (!r.surface) return 1.0;
  if (dot(r.normal, towardsLight(r.position, 0)) <= 0.0) return 0.0;
  LightPoint l = lightSpace(r.position, 0);
  if (!l.inside) return 1.0;
  if (in_volume) return 0.0;
  return MASKED ? shadowMapTest(shadow_map, r, l, push.normal_offset, 0.0) : 1.0;
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, ivec2(view.size)))) return;
  // The blended count is negative if the camera mirrors.
  float count = BLENDED ? texelFetch(blended, pixel, 0).x : float(texelFetch(stencil, pixel, 0).x);
  imageStore(visibility, pixel, vec4(visibilityAt(pixel, count != 0.0)));
  if (KEEP_COUNT) imageStore(count_image, pixel, vec4(count));
}
