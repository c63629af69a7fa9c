#version 460
// Exponential variance shadow maps: Lauritzen, McCool (2008). Variance shadow maps of warped depths: behind an occluder
// the first warp leaves little light, and the second mends the first where the receiver itself fills the window.
//
// Departures: as in vsm.comp.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "lib/moments.glsl"
#include "moment_lookup.glsl"

layout(constant_id = 2) const bool BOTH_WARPS = true; // false: the first alone

float litShare(vec4 b, float t) {
  vec2 warped = warpDepth(t, push.exponents);
  // The least deviation of the depths, warped.
  vec2 deviation = push.least_deviation * push.exponents * warped;
  vec2 least = deviation * deviation;
  float v = chebyshev(b.x, b.y, warped.x, least.x);
  if (BOTH_WARPS) v = min(v, chebyshev(b.z, b.w, warped.y, least.y));
  return v;
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, ivec2(view.size)))) return;
  vec4 b;
  float t, v;
  if (!lookUp(pixel, b, t, v)) v = reduceLeaking(litShare(b, t), push.reduction);
  imageStore(visibility, pixel, vec4(v));
}
