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

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, ivec2(view.size)))) return;
  vec4 b;
  float t, v;
  if (!lookUp(pixel, b, t, v)) v = reduceLeaking(litShare(b, t), push.reduction);
  imageStore(visibility, pixel, vec4(v));
}
