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
#extension GL_EXT_control_flow_attributes : require
#include "lib/shadow_test.glsl"

struct Blockers {
  float z;   // mean linear distance of the blockers; undefined if there is none
  int count; // taps that found a blocker, out of taps * taps
};

// Value of a blocker that the search averages, and the linear distance that belongs to the mean.
float blockerValue(AreaLight a, float stored, bool mean_depth) { return mean_depth ? stored : lightDistance(a, stored); }
float blockerDistance(AreaLight a, float mean, bool mean_depth) { return mean_depth ? lightDistance(a, mean) : mean; }

vec4 blockerValues(AreaLight a, vec4 stored, bool mean_depth) {
  precise vec4 spot = a.depth_scale / max(a.depth_offset - stored, vec4(1e-7)), sun = stored * a.depth_offset;
  return mean_depth ? stored : mix(sun, spot, bvec4(a.depth_scale > 0.0));
}

// Numbers of the taps along an axis that lie before the far borders of texel t and the next one: tap i lies at
// `at` + ((2 i + 1)/taps - 1) h, h the half-width. All lie before the border of texel `last`, whatever the rounding.
vec2 tapsBefore(int t, int last, float at, float taps_a_texel, float taps) {
  precise vec2 before = ceil((vec2(t + 1, t + 2) - at) * taps_a_texel + 0.5 * (taps - 1.0));
  return mix(clamp(before, vec2(0.0), vec2(taps)), vec2(taps), greaterThanEqual(ivec2(t, t + 1), ivec2(last)));
}

// Searches the window of the given half-width (uv) around the receiver. Outside the map, taps read its border texels. In
// windows of at most `taps` texels along each axis, every texel is read once, four per gather, and counts as often as taps
// lie in it. A search that is not `wanted` finds nothing, and reads nothing where no neighbour wants one: the loops have no
// rounds then, whereas a CPU driver executes both sides of every branch.
Blockers findBlockers(sampler2DArray shadow_map, SoftReceiver r, AreaLight a, vec2 half_width, int taps, bool mean_depth, bool wanted) {
  vec2 half_texels = windowTexels(half_width);
  ivec2 map_size = ivec2(view.map_size);
  ivec2 first = tapTexel(r, half_texels, 0, 0, taps), last = tapTexel(r, half_texels, taps - 1, taps - 1, taps);
  bool is_narrow = all(lessThan(last - first, ivec2(taps)));
  precise float sum = 0.0;
  float count = 0.0;
  precise vec2 taps_a_texel = 0.5 * float(taps) / max(half_texels, vec2(1e-6));
  ivec2 end = wanted && is_narrow ? last : first - 1;
  float above = 0.0;
  [[dont_unroll]] for (int y = first.y; y <= end.y; y += 2) {
    vec2 below = tapsBefore(y, last.y, r.at.y, taps_a_texel.y, float(taps));
    vec2 rows = below - vec2(above, below.x);
    above = below.y;
    float left = 0.0;
    [[dont_unroll]] for (int x = first.x; x <= end.x; x += 2) {
      vec2 right = tapsBefore(x, last.x, r.at.x, taps_a_texel.x, float(taps));
      vec2 columns = right - vec2(left, right.x);
      left = right.y;
      // Rounding cannot select other texels at the common corner of the four.
      vec4 stored = textureGather(shadow_map, vec3(vec2(x + 1, y + 1) / vec2(view.map_size), 0.0));
      vec4 blocks = vec4(greaterThan(min(softReference2x2(r, ivec2(x, y)), vec4(1.0)), stored));
      precise vec4 share = columns.xyyx * rows.yyxx * blocks;
      sum += dot(share, blockerValues(a, stored, mean_depth));
      count += dot(share, vec4(1.0));
    }
  }
  int tap_rows = wanted && !is_narrow ? taps : 0;
  [[dont_unroll]] for (int j = 0; j < tap_rows; ++j) {
    [[dont_unroll]] for (int i = 0; i < taps; ++i) {
      ivec2 texel = windowTap(r, half_texels, i, j, taps);
      float stored = shadowMapDepth(shadow_map, texel, 0, map_size);
      bool blocks = shadowTest(softReference(r, texel), stored) == 0.0;
      sum += blocks ? blockerValue(a, stored, mean_depth) : 0.0;
      count += float(blocks);
    }
  }
  precise float mean = sum / max(count, 1.0);
  return Blockers(blockerDistance(a, mean, mean_depth), int(count));
}

Blockers findBlockers(sampler2DArray shadow_map, SoftReceiver r, AreaLight a, vec2 half_width, int taps, bool mean_depth) {
  return findBlockers(shadow_map, r, a, half_width, taps, mean_depth, true);
}

#endif
