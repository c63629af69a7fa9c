// Blocker search of percentage-closer soft shadows: Fernando (2005); Macedo, Apolinario, Aguero (2019), eq. 6.
// Include after common/soft_receiver.glsl.
//
// Departures from eq. 6:
// * The search averages linear distances, not stored depths: under a perspective light the mean of stored depths is a
//   harmonic mean of distances.
// * The denominator has no epsilon, which would pull the mean towards the light.
// * Every texel is compared with the receiver's plane at that texel, so that a tilted receiver does not block itself.
//
// Taps lie at the centres of the window's taps x taps grid, all with the same weight. In a window narrower than `taps`
// texels several taps fall into one texel. A texel then weighs by the number of taps in it, which matches its share of
// the window to within one row and one column of taps. So a texel that the window only grazes may weigh nothing, and
// the result never jumps by more than a row of taps while the window slides.
#ifndef EDGESHADE_BLOCKERS
#define EDGESHADE_BLOCKERS
#include "lib/shadow_test.glsl"

struct Blockers {
  float z;   // mean linear distance of the blockers; undefined if there is none
  int count; // taps that found a blocker, out of taps * taps
};

// Searches the window of the given half-width (uv) around the receiver. Outside the map, taps read its border texels.
Blockers findBlockers(sampler2DArray shadow_map, SoftReceiver r, AreaLight a, vec2 half_width, int taps) {
  vec2 half_texels = windowTexels(half_width);
  ivec2 map_size = ivec2(view.map_size);
  precise float sum = 0.0;
  int count = 0;
  for (int j = 0; j < taps; ++j) {
    for (int i = 0; i < taps; ++i) {
      ivec2 texel = windowTap(r, half_texels, i, j, taps);
      float stored = shadowMapDepth(shadow_map, texel, 0, map_size);
      bool blocks = shadowTest(softReference(r, texel), stored) == 0.0;
      sum += blocks ? lightDistance(a, stored) : 0.0;
      count += int(blocks);
    }
  }
  precise float z = sum / float(max(count, 1));
  return Blockers(z, count);
}

#endif
