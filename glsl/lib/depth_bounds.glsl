// Bounds of the depths in a block of shadow-map texels, measured from a plane of the block's own.
//
// A plain minimum and maximum (Guennebaud, Barthe, Paulin 2006) cannot decide a tilted receiver: over a block the
// receiver's own depth varies more than any bias allows. Bounds around a slope can. For a texel t of a block with
// centre c, the stored depth S(t) lies within slope * (t - c) + [low, high].
#ifndef EDGESHADE_DEPTH_BOUNDS
#define EDGESHADE_DEPTH_BOUNDS

struct DepthBounds {
  vec2 slope; // change of depth per texel
  float low;
  float high;
};

// Bound of the rounding error where a slope over `texels` texels is subtracted from depths in [0, 1].
float boundsRounding(vec2 slope, float texels) {
  float reach = (abs(slope.x) + abs(slope.y)) * texels;
  return reach == 0.0 ? 0.0 : 3e-7 + 3e-7 * reach;
}

// Sets a slope that is too flat to matter to 0; the bounds are then the exact minimum and maximum.
vec2 usefulSlope(vec2 slope) {
  return vec2(abs(slope.x) < 1e-7 ? 0.0 : slope.x, abs(slope.y) < 1e-7 ? 0.0 : slope.y);
}

// The flatter of two slopes along each axis. Where a block holds two surfaces or a depth edge, it still fits one of
// them.
vec2 flatter(vec2 a, vec2 b) {
  return vec2(abs(a.x) < abs(b.x) ? a.x : b.x, abs(a.y) < abs(b.y) ? a.y : b.y);
}

// Extends `parent`, whose slope is set, to hold a child block of `size` texels whose centre lies at `offset`.
void includeBlock(inout DepthBounds parent, DepthBounds child, vec2 offset, float size) {
  vec2 turn = abs(child.slope - parent.slope);
  float spread = (turn.x + turn.y) * 0.5 * (size - 1.0) + boundsRounding(turn + abs(parent.slope), size);
  float shift = dot(parent.slope, offset);
  parent.low = min(parent.low, child.low - shift - spread);
  parent.high = max(parent.high, child.high - shift + spread);
}

#endif
