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

float visibilityAt(ivec2 pixel) {
  Receiver r = receiverAt(pixel);
  MapReceiver m;
  float decided;
  if (mapReceiver(r, push.normal_offset, 0.0, m, decided)) return decided;
  MapFootprint f = mapFootprint(pixel, r);
  return reduceLeaking(litShare(momentsAt(m.uv, f), momentReference(m, f)), push.reduction);
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (all(lessThan(pixel, ivec2(view.size)))) imageStore(visibility, pixel, vec4(visibilityAt(pixel)));
}
