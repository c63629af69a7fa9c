#version 460
// Variance shadow maps: Donnelly, Lauritzen (2006). The mean and the variance of the depths in a window bound the share of
// it that is lit.
//
// Departures: depths are linear and signed, see lib/moments.glsl. The receiver moves along its normal by what its plane
// needs (common/receiver.glsl). A mip chain is read by taps along the longer axis of what a pixel covers.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "lib/moments.glsl"
#include "moment_lookup.glsl"

float litShare(vec4 b, float t) { return chebyshev(b.x, b.y, t, push.least_deviation * push.least_deviation); }

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
