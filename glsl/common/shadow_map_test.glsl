// The hard shadow test of a receiver inside the light's frustum, against the texel that its point falls into.
// Williams, "Casting Curved Shadows on Curved Surfaces" (1978); [JCGT] eq. 1.
// Departure: the point moves along its normal by the offset that clears its plane's own depth, instead of a constant
// depth bias. So one setting holds at every scale and slope.
// Include after common/receiver.glsl.
#ifndef EDGESHADE_SHADOW_MAP_TEST
#define EDGESHADE_SHADOW_MAP_TEST
#include "lib/shadow_test.glsl"

// `normal_offset` is in multiples of the offset that a plane needs, `depth_bias` in depth units.
float shadowMapTest(sampler2DArray shadow_map, Receiver r, LightPoint l, float normal_offset, float depth_bias) {
  l = lightSpace(offsetReceiver(r, l, normal_offset, 0), 0);
  if (!l.inside) return 1.0;
  ivec2 map_size = ivec2(view.map_size);
  ivec2 texel = min(ivec2(l.uv * vec2(map_size)), map_size - 1);
  return shadowTest(l.depth - depth_bias - DEPTH_ULPS, shadowMapDepth(shadow_map, texel, 0, map_size));
}

#endif
