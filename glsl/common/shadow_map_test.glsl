// The hard test of a receiver against the texel that its point falls into, for those inside the light's frustum.
// Williams, "Casting Curved Shadows on Curved Surfaces" (1978); [JCGT] eq. 1.
// Departure: the point is moved along its normal by what its plane needs to clear its own depth, instead of a
// constant depth bias, so that one setting holds at every scale and slope.
#ifndef EDGESHADE_SHADOW_MAP_TEST
#define EDGESHADE_SHADOW_MAP_TEST
#include "receiver.glsl"
#include "lib/shadow_test.glsl"

// `normal_offset` in multiples of what a plane needs, `depth_bias` in depth units on top.
float shadowMapTest(sampler2DArray shadow_map, Receiver r, LightPoint l, float normal_offset, float depth_bias) {
  l = lightSpace(offsetReceiver(r, l, normal_offset, 0), 0);
  if (!l.inside) return 1.0;
  ivec2 map_size = ivec2(view.map_size);
  ivec2 texel = min(ivec2(l.uv * vec2(map_size)), map_size - 1);
  return shadowTest(l.depth - depth_bias - DEPTH_ULPS, shadowMapDepth(shadow_map, texel, 0, map_size));
}

#endif
