#version 460
// Shadow mapping: one test a pixel against the texel that its point falls into.
// Williams, "Casting Curved Shadows on Curved Surfaces" (1978); [JCGT] eq. 1.
// Departure: the point is moved along its normal by what its plane needs to clear its own depth, instead of a
// constant depth bias, so that one setting holds at every scale and slope.
#extension GL_GOOGLE_include_directive : require
#include "receiver.glsl"
#include "lib/shadow_test.glsl"
#include "pixel_steps.glsl" // all pixels at once, or those of a list that another pass makes

layout(binding = 3) uniform sampler2DArray shadow_map;

layout(push_constant, scalar) uniform Push {
  float normal_offset; // multiples of what a plane needs
  float depth_bias;    // depth units on top
} push;

float testAt(ivec2 pixel) {
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

bool visibilityAt(ivec2 pixel, out float v) {
  v = testAt(pixel);
  return true;
}
