// The moments of a texel as numbers in [0, 1], of which summed-area tables hold sums: two or four.
// Include after lib/moments.glsl and moment_kind.glsl.
#ifndef EDGESHADE_TABLE_UNIT
#define EDGESHADE_TABLE_UNIT

// Packed moments lie there already; warped ones have no such form, their range is too great.
vec4 toUnit(vec4 m) { return KIND == VARIANCE ? vec4(0.5 * m.x + 0.5, m.y, 0.0, 0.0) : m; }

// `scale` is such that the sum over the largest window stays below 2^32.
uvec4 quantised(float depth, float range, float scale) {
  return uvec4(clamp(toUnit(momentsOf(depth, range, vec2(0.0))), 0.0, 1.0) * scale + 0.5);
}

#endif
