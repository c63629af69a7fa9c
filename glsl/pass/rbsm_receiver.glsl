// What the revectorization passes share: push constants, a pixel's point in the shadow map, the shadow test on its plane.
#ifndef EDGESHADE_RBSM_RECEIVER
#define EDGESHADE_RBSM_RECEIVER
#include "map_receiver.glsl"
#include "lib/rbsm.glsl"
#include "lib/shadow_test.glsl"

layout(constant_id = 0) const bool FIXED = false; // the listings' fixed depth instead of the receiver's plane

layout(binding = 3) uniform sampler2DArray shadow_map;

layout(push_constant, scalar) uniform Push {
  float normal_offset; // multiples of what a plane needs
  float depth_bias;    // fraction of a texel's slope, along both axes
  float slack;         // texels of depth a texel of distance that a curved receiver may lie before its plane
} push;

float shadowTest(ShadowPoint p, ivec2 texel) {
  return shadowTest(receiverDepth(p, texel), shadowMapDepth(shadow_map, texel, 0, ivec2(view.map_size)));
}

// True where no shadow-map texel is needed; then `decided` is the visibility.
bool rbsmReceiver(ivec2 pixel, out ShadowPoint p, out float decided) {
  MapReceiver m;
  if (mapReceiver(pixel, push.normal_offset, push.depth_bias, m, decided)) return true;
  vec2 map_size = vec2(view.map_size);
  if (FIXED) p = shadowPoint(m.uv * map_size, m.depth, vec2(0.0), 0.0);
  else p = shadowPoint(m.uv * map_size, m.depth, m.plane / map_size, push.slack * m.texel_depth);
  return false;
}

// The texel's own test and, in `N`, those of its neighbours (listing 2's computeN): two gathers at its corners.
float testNeighbourhood(ShadowPoint p, out vec4 N) {
  vec2 size = vec2(view.map_size);
  // Gather order: (0, 1), (1, 1), (1, 0), (0, 0). The sampler's border is white.
  vec4 upper = textureGather(shadow_map, vec3(vec2(p.texel) / size, 0.0));
  vec4 lower = textureGather(shadow_map, vec3(vec2(p.texel + 1) / size, 0.0));
  N.x = shadowTest(receiverDepth(p, p.texel + ivec2(-1, 0)), upper.x);
  N.y = shadowTest(receiverDepth(p, p.texel + ivec2(1, 0)), lower.z);
  N.z = shadowTest(receiverDepth(p, p.texel + ivec2(0, 1)), lower.x);
  N.w = shadowTest(receiverDepth(p, p.texel + ivec2(0, -1)), upper.z);
  return shadowTest(receiverDepth(p, p.texel), upper.y);
}

#endif
