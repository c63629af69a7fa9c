#version 460
// Moment soft shadow mapping: Peters, Muenstermann, Wetzstein, Klein (2017). Four moments of the depths in a window, from
// a summed-area table, give a distribution of three depths, one of them the receiver's. Those in front of the receiver
// are what blocks, and their mean depth says how wide the penumbra is. A second window as wide gives the least shadow.
//
// Departures: blockers are searched no farther than the nearest of them requires, and windows that are all lit or all in
// shadow decide (common/hsm.glsl).
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "common/soft_receiver.glsl"
#include "lib/pcf.glsl"
#include "common/pcf_bounds.glsl"
#include "common/hsm.glsl"
#include "soft_filter.glsl"
#include "lib/moments.glsl"
#include "filtering/summed_area.glsl"
#include "moment_window.glsl"

vec4 momentsIn(Window w) {
  return biasMoments(unpackMoments(meanOver(table, w.low, w.high, push.scale)), POSSIBLE_PACKED, push.moment_bias);
}

float visibilityAt(ivec2 pixel) {
  AreaLight a = areaLight();
  SoftReceiver r;
  vec2 search;
  float nearest, v;
  if (searched(pixel, a, r, search, nearest, v)) return v;
  Window w = windowOf(r, windowTexels(search));
  ThreeDepths d = threeDepths(momentsIn(w), w.t);
  float shadow = hamburgerShadow(d, w.t);
  if (shadow > 0.99) return 0.0;
  float blocking = (d.z.x < w.t ? d.w.x * d.z.x : 0.0) + (d.z.y < w.t ? d.w.y * d.z.y : 0.0);
  // If hardly anything blocks, the blocker is taken to be the receiver itself, so that the filter is narrow.
  const float NOTHING = 1e-3;
  float blocker = (NOTHING * w.t + blocking) / (NOTHING + shadow);
  blocker = blocker > nearest ? min(blocker, w.t) : nearest;
  w = windowOf(r, softHalfTexels(r, a, distanceOf(a, blocker), search));
  return reduceLeaking(1.0 - hamburgerShadow(momentsIn(w), w.t), push.reduction);
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (all(lessThan(pixel, ivec2(view.size)))) imageStore(visibility, pixel, vec4(visibilityAt(pixel)));
}
