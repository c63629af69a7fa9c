// Percentage-closer filtering over a window of any width: the mean of shadow tests against the receiver's plane.
// Include after common/soft_receiver.glsl.
#ifndef EDGESHADE_SOFT_FILTER
#define EDGESHADE_SOFT_FILTER
#include "lib/shadow_test.glsl"

// Half-widths of the narrowest windows, texels. The narrowest filter makes an edge as wide as a bilinear test does; the
// narrowest search covers the texels that such a test reads.
const float NARROWEST_FILTER = 0.5, NARROWEST_SEARCH = 1.0;

// Half-width of the filter, texels. The limit keeps rounding from widening it beyond the window that was searched and
// classified.
vec2 softHalfTexels(SoftReceiver r, AreaLight a, float z_blocker, vec2 search) {
  precise vec2 half_texels = windowTexels(min(filterHalfWidth(a, r.z, z_blocker), search));
  return max(half_texels, vec2(NARROWEST_FILTER));
}

// Shadow tests of 2 x 2 texels by one gather at their common corner, where rounding cannot select other texels.
vec4 softTest2x2(sampler2DArray shadow_map, SoftReceiver r, ivec2 first) {
  vec4 stored = textureGather(shadow_map, vec3(vec2(first + 1) / vec2(view.map_size), 0.0));
  return vec4(lessThanEqual(min(softReference2x2(r, first), vec4(1.0)), stored));
}

// The exact mean over the window, in which each texel counts by the area it covers: the limit of infinitely many taps.
// It reads every texel once, four per gather, so in windows a few texels wide it costs less than separate taps.
float filterBox(sampler2DArray shadow_map, SoftReceiver r, vec2 half_texels) {
  precise vec2 low = r.at - half_texels, high = r.at + half_texels;
  ivec2 first = ivec2(floor(low)), last = ivec2(floor(high));
  precise float lit = 0.0, dark = 0.0;
  for (int y = first.y; y <= last.y; y += 2) {
    precise vec2 height = max(min(vec2(y, y + 1) + 1.0, high.y) - max(vec2(y, y + 1), low.y), 0.0);
    for (int x = first.x; x <= last.x; x += 2) {
      vec4 s = softTest2x2(shadow_map, r, ivec2(x, y));
      precise vec2 width = max(min(vec2(x, x + 1) + 1.0, high.x) - max(vec2(x, x + 1), low.x), 0.0);
      precise vec4 share = width.xyyx * height.yyxx;
      lit += dot(s, share);
      dark += dot(1.0 - s, share);
    }
  }
  // Exactly 0 or 1 where all tests agree.
  precise float v = dark == 0.0 ? 1.0 : lit / (lit + dark);
  return v;
}

// The mean of n x n taps at the centres of a regular grid over the window. Each tap tests the texel under it, or with
// `bilinear` weights the tests of the 2 x 2 texels around it.
float filterTaps(sampler2DArray shadow_map, SoftReceiver r, vec2 half_texels, int n, bool bilinear) {
  ivec2 map_size = ivec2(view.map_size);
  precise float lit = 0.0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      if (bilinear) {
        precise vec2 place = r.at + ((2.0 * vec2(i, j) + 1.0) / float(n) - 1.0) * half_texels - 0.5;
        precise vec2 first = floor(place), f = place - first;
        vec4 s = softTest2x2(shadow_map, r, ivec2(first));
        precise vec2 rows = s.wx + f.x * (s.zy - s.wx);
        lit += rows.x + f.y * (rows.y - rows.x);
      } else {
        ivec2 texel = windowTap(r, half_texels, i, j, n);
        lit += shadowTest(softReference(r, texel), shadowMapDepth(shadow_map, texel, 0, map_size));
      }
    }
  }
  return lit == float(n * n) ? 1.0 : min(lit / float(n * n), 1.0);
}

#endif
