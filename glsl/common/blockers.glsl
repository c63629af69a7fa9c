// Blocker search of percentage-closer soft shadows: Fernando (2005); Macedo, Apolinario, Aguero (2019), eq. 6.
// Include after common/soft_receiver.glsl.
//
// Departures from eq. 6:
// * By default the search averages linear distances: under a perspective light the mean of the stored depths, which the
//   paper prints, is a harmonic mean of distances. `mean_depth` averages the stored depths and takes the distance of the
//   mean.
// * The denominator has no epsilon, which would pull the mean towards the light.
// * Every texel is compared with the receiver's plane at that texel, so that a tilted receiver does not block itself.
//   With a slope of 0 all texels are compared with the point's own depth, as in the paper.
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

// Value of a blocker that the search averages, and the linear distance that belongs to the mean.
float blockerValue(AreaLight a, float stored, bool mean_depth) { return mean_depth ? stored : lightDistance(a, stored); }
float blockerDistance(AreaLight a, float mean, bool mean_depth) { return mean_depth ? lightDistance(a, mean) : mean; }

// Searches the window of the given half-width (uv) around the receiver. Outside the map, taps read its border texels.
Blockers findBlockers(sampler2DArray shadow_map, SoftReceiver r, AreaLight a, vec2 half_width, int taps, bool mean_depth) {
  vec2 half_texels = windowTexels(half_width);
  ivec2 map_size = ivec2(view.map_size);
  precise float sum = 0.0;
  int count = 0;
  for (int j = 0; j < taps; ++j) {
    for (int i = 0; i < taps; ++i) {
      ivec2 texel = windowTap(r, half_texels, i, j, taps);
      float stored = shadowMapDepth(shadow_map, texel, 0, map_size);
      bool blocks = shadowTest(softReference(r, texel), stored) == 0.0;
      sum += blocks ? blockerValue(a, stored, mean_depth) : 0.0;
      count += int(blocks);
    }
  }
  precise float mean = sum / float(max(count, 1));
  return Blockers(blockerDistance(a, mean, mean_depth), count);
}

#endif
