// The blocker search of percentage-closer soft shadows: Fernando (2005); Macedo, Apolinario, Aguero (2019), eq. 6.
//
// Departures from eq. 6: distances are averaged, not stored depths, whose mean is a harmonic one under a perspective light;
// no epsilon in the denominator, which would draw the mean towards the light; every texel is compared with the receiver's
// plane at that texel, so that a tilted receiver does not block itself.
//
// Taps lie at the centres of the window's taps x taps cells, each with the same weight. In a window narrower than `taps`
// texels several taps share a texel: a texel then weighs by the number of cell centres in it, which is its share of the
// window to within one row and one column of cells. So a texel that the window only grazes may weigh nothing, and nothing
// jumps by more than a row of taps as the window slides.
#ifndef EDGESHADE_BLOCKERS
#define EDGESHADE_BLOCKERS
#include "lib/shadow_test.glsl"
#include "soft_receiver.glsl"

struct Blockers {
  float z;   // mean linear distance of the blockers; undefined if there is none
  int count; // taps that found one, of taps * taps
};

// `half_width` in uv. Beyond the map its border goes on.
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
