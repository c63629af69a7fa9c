// Common part of the revectorization passes: push constants, a pixel's point in the shadow map, and the shadow test on
// the receiver's plane. A shader that defines MAP_GOES_ON reads the map's border texels outside the map.
// Include after common/receiver.glsl.
#ifndef EDGESHADE_RBSM_RECEIVER
#define EDGESHADE_RBSM_RECEIVER
#define RBSM_GATHER
#include "lib/rbsm.glsl"
#include "lib/shadow_test.glsl"

layout(constant_id = 0) const bool FIXED = false; // the listings' fixed depth instead of the receiver's plane

layout(binding = 3) uniform sampler2DArray shadow_map;

layout(push_constant, scalar) uniform Push {
  float normal_offset; // multiples of the offset that a plane needs
  float depth_bias;    // fraction of the plane's change of depth per texel, over both axes
  float slack;         // by how much a curved receiver may lie in front of its plane: texel depths per texel of distance
} push;

// Returns the texel to read for one that may lie outside the map. Filters with windows wider than the map define
// MAP_GOES_ON and take the nearest border texel. For all others everything outside the map is lit.
ivec2 testedTexel(ivec2 texel) {
#ifdef MAP_GOES_ON
  return nearestTexel(texel, ivec2(view.map_size));
#else
  return texel;
#endif
}

float shadowTest(ShadowPoint p, ivec2 texel) {
  texel = testedTexel(texel);
  return shadowTest(receiverDepth(p, texel), shadowMapDepth(shadow_map, texel, 0, ivec2(view.map_size)));
}

uint receiverTests2x2(ShadowPoint p, ivec2 corner) {
  // Rounding cannot select other texels at the common corner of the four. Gather order:
  // (0, 1), (1, 1), (1, 0), (0, 0). The sampler's border is white, or repeats the map's border with MAP_GOES_ON.
  vec4 stored = textureGather(shadow_map, vec3(vec2(corner + 1) / vec2(view.map_size), 0.0));
  return uint(shadowTest(receiverDepth(p, testedTexel(corner)), stored.w)) |
         uint(shadowTest(receiverDepth(p, testedTexel(corner + ivec2(1, 0))), stored.z)) << 1 |
         uint(shadowTest(receiverDepth(p, testedTexel(corner + ivec2(0, 1))), stored.x)) << 2 |
         uint(shadowTest(receiverDepth(p, testedTexel(corner + ivec2(1, 1))), stored.y)) << 3;
}

// A shader that defines OWN_TESTS defines the four tests itself.
#ifndef OWN_TESTS
uint shadowTest2x2(ShadowPoint p, ivec2 corner) { return receiverTests2x2(p, corner); }
#endif

// Returns true if the visibility needs no texel of the shadow map; `decided` then holds it.
bool rbsmReceiver(Receiver r, out ShadowPoint p, out float decided) {
  MapReceiver m;
  if (mapReceiver(r, push.normal_offset, push.depth_bias, m, decided)) return true;
  vec2 map_size = vec2(view.map_size);
  if (FIXED) p = shadowPoint(m.uv * map_size, m.depth, vec2(0.0), 0.0);
  else p = shadowPoint(m.uv * map_size, m.depth, m.plane / map_size, push.slack * m.texel_depth);
  return false;
}

bool rbsmReceiver(ivec2 pixel, out ShadowPoint p, out float decided) { return rbsmReceiver(receiverAt(pixel), p, decided); }

// Tests the texel itself, and in `N` its neighbours (computeN of listing 2).
float testNeighbourhood(ShadowPoint p, out vec4 N) {
  uint upper = shadowTest2x2(p, p.texel - 1), lower = shadowTest2x2(p, p.texel);
  N = vec4(upper >> 2 & 1u, lower >> 1 & 1u, lower >> 2 & 1u, upper >> 1 & 1u);
  return float(upper >> 3);
}

#endif
