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

#endif
