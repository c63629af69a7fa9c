#version 460
// Variance soft shadow mapping: Yang, Dong, Feng, Seidel, Kautz (2010). The mean and the variance of the depths in a
// window, from a summed-area table, give the share of it that is lit and, with the receiver's depth for what is lit, the
// mean depth of what blocks. That is as wide as the penumbra, over which a second window gives the visibility.
//
// Where the mean lies behind the receiver the inequality says nothing: a window is cut into cells, those whose mean lies
// behind count as lit, and the others are taken together.
//
// Departures: blockers are searched no farther than the nearest of them requires (common/hsm.glsl). Cells are all of one
// size, instead of a tree of them.
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

layout(constant_id = 2) const int CELLS = 2; // along each axis, if they have about a texel each

// Moments of the cells whose mean lies in front of the receiver, and the share of the window that they cover.
struct Blocking {
  float mean;
  float square;
  float share;
};

Blocking blocking(Window w) {
  vec2 size = w.high - w.low;
  // The narrowest windows are whole texels wide: rounding to the nearest, a few bits do not change the number of cells.
  int cells = clamp(int(min(size.x, size.y) + 0.5), 1, CELLS);
  Blocking b = Blocking(0.0, 0.0, 0.0);
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      vec2 low = w.low + size * vec2(i, j) / float(cells), high = w.low + size * vec2(i + 1, j + 1) / float(cells);
      vec2 unit = meanOver(table, low, high, push.scale).xy;
      float mean = 2.0 * unit.x - 1.0;
      if (mean < w.t) {
        b.mean += mean;
        b.square += unit.y;
        b.share += 1.0;
      }
    }
  }
  b.mean /= max(b.share, 1.0);
  b.square /= max(b.share, 1.0);
  b.share /= float(cells * cells);
  return b;
}

float visibilityAt(ivec2 pixel) {
  AreaLight a = areaLight();
  SoftReceiver r;
  vec2 search;
  float nearest, v;
  if (searched(pixel, a, r, search, nearest, v)) return v;
  Window w = windowOf(r, windowTexels(search));
  Blocking b = blocking(w);
  if (b.share == 0.0) return 1.0;
  // The mean is that of what blocks and of what does not, which has the receiver's depth.
  float lit = min(chebyshev(b.mean, b.square, w.t, push.least_variance), 0.999);
  float blocker = clamp((b.mean - lit * w.t) / (1.0 - lit), nearest, w.t);
  w = windowOf(r, softHalfTexels(r, a, distanceOf(a, blocker), search));
  b = blocking(w);
  if (b.share == 0.0) return 1.0;
  v = 1.0 - b.share + b.share * chebyshev(b.mean, b.square, w.t, push.least_variance);
  return reduceLeaking(v, push.reduction);
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (all(lessThan(pixel, ivec2(view.size)))) imageStore(visibility, pixel, vec4(visibilityAt(pixel)));
}
