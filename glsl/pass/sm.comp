#version 460
// Shadow mapping: one test a pixel against the texel that its point falls into.
// Williams, "Casting Curved Shadows on Curved Surfaces" (1978); [JCGT] eq. 1.
// Departure: the point is moved along its normal by what its plane needs to clear its own depth, instead of a
// constant depth bias, so that one setting holds at every scale and slope.
#extension GL_GOOGLE_include_directive : require
#include "receiver.glsl"
#include "lib/shadow_test.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 3) uniform sampler2DArray shadow_map;
layout(binding = 4) writeonly uniform image2D visibility;

layout(push_constant, scalar) uniform Push {
  float normal_offset; // multiples of what a plane needs
  float depth_bias;    // depth units on top
} push;

float visibilityAt(ivec2 pixel) {
  Receiver r = receiverAt(pixel);
  if (!r.surface) return 1.0;
  if (dot(r.normal, towardsLight(r.position, 0)) <= 0.0) return 0.0;
  LightPoint l = lightSpace(r.position, 0);
  if (!l.inside) return 1.0;
  l = lightSpace(offsetReceiver(r, l, push.normal_offset, 0), 0);
  if (!l.inside) return 1.0;
  ivec2 map_size = ivec2(view.map_size);
  ivec2 texel = min(ivec2(l.uv * vec2(map_size)), map_size - 1);
  return shadowTest(l.depth - push.depth_bias - DEPTH_ULPS, shadowMapDepth(shadow_map, texel, 0, map_size));
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, ivec2(view.size)))) return;
  imageStore(visibility, pixel, vec4(visibilityAt(pixel)));
}
