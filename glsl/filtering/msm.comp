#version 460
// Moment shadow mapping: Peters, Klein (2015), in the form of Peters, Muenstermann, Wetzstein, Klein (2017). Four moments
// of the depths in a window give the least share of it that is in shadow.
//
// Departures: as in vsm.comp; and lib/moments.glsl has a branch of its own for receivers that lie on a depth of the window.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "lib/moments.glsl"
#include "moment_lookup.glsl"

layout(constant_id = 2) const bool HAUSDORFF = false; // no depths outside the map's range
layout(constant_id = 3) const bool BITS_16 = false;   // the moments are packed into 16-bit integers

float litShare(vec4 stored, float t) {
  vec4 b = biasMoments(BITS_16 ? unpackMoments(stored) : stored, BITS_16 ? POSSIBLE_PACKED : POSSIBLE, push.moment_bias);
  return 1.0 - (HAUSDORFF ? hausdorffShadow(b, t) : hamburgerShadow(b, t));
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, ivec2(view.size)))) return;
  vec4 b;
  float t, v;
  if (!lookUp(pixel, b, t, v)) v = reduceLeaking(litShare(b, t), push.reduction);
  imageStore(visibility, pixel, vec4(v));
}
