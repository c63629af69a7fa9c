// Summed-area tables of unsigned integers: Crow, "Summed-area tables for texture mapping" (1984), in the fixed-point form
// of Lauritzen, "Summed-area variance shadow maps" (GPU Gems 3, 2007). Entry (x, y) is the sum of the texels 0 to x and 0
// to y, modulo 2^32. The difference of four entries is exact whenever the sum over the window itself is below 2^32,
// however large the map is and however often its entries have wrapped around.
// Binding-free.
#ifndef EDGESHADE_SUMMED_AREA
#define EDGESHADE_SUMMED_AREA

// Sum of the texels left of and above `corner`. Corners beyond the map are moved to its border.
uvec4 sumUpTo(usampler2D table, ivec2 corner) {
  ivec2 at = min(corner, textureSize(table, 0)) - 1;
  return any(lessThan(at, ivec2(0))) ? uvec4(0) : texelFetch(table, at, 0);
}

// Sum of the texels `first` to `end`, without `end`, as far as they lie in the map.
uvec4 sumOver(usampler2D table, ivec2 first, ivec2 end) {
  return sumUpTo(table, end) - sumUpTo(table, ivec2(first.x, end.y)) - sumUpTo(table, ivec2(end.x, first.y)) +
         sumUpTo(table, first);
}

// Along one axis, a window covers a part of a texel, whole texels, and a part of another: where these begin, and the
// share of each texel that counts.
void windowParts(float low, float high, out ivec4 edges, out vec3 shares) {
  int first = int(floor(low)), last = max(int(floor(high)), first + 1);
  bool one = int(floor(high)) == first;
  edges = ivec4(first, first + 1, last, one ? last : last + 1);
  shares = vec3((one ? high : float(first + 1)) - low, 1.0, one ? 0.0 : high - float(last));
}

// Mean of the moments over a window in the map, as shares of `scale`. Texels at its rim count by the area that it covers.
// The sums of whole texels are taken as integers: interpolated entries of the table would lose all that makes it exact.
vec4 meanOver(usampler2D table, vec2 low, vec2 high, float scale) {
  ivec4 x, y;
  vec3 across, down;
  windowParts(low.x, high.x, x, across);
  windowParts(low.y, high.y, y, down);
  vec4 sum = vec4(0.0);
  uvec4 above0, above1, above2;
  for (int j = 0; j < 4; ++j) {
    uvec4 s0 = sumUpTo(table, ivec2(x[0], y[j])), s1 = sumUpTo(table, ivec2(x[1], y[j]));
    uvec4 s2 = sumUpTo(table, ivec2(x[2], y[j])), s3 = sumUpTo(table, ivec2(x[3], y[j]));
    uvec4 part0 = s1 - s0, part1 = s2 - s1, part2 = s3 - s2;
    if (j > 0) {
      sum += down[j - 1] * (across[0] * vec4(part0 - above0) + across[1] * vec4(part1 - above1) + across[2] * vec4(part2 - above2));
    }
    above0 = part0;
    above1 = part1;
    above2 = part2;
  }
  vec2 size = high - low;
  return sum / (scale * size.x * size.y);
}

#endif
