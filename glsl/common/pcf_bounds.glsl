// Decides a filter kernel by the depth bounds of the blocks under it, without reading texels.
// Include after lib/pcf.glsl.
#ifndef EDGESHADE_PCF_BOUNDS
#define EDGESHADE_PCF_BOUNDS
#include "lib/depth_bounds.glsl"

const int UNDECIDED = -1;

// Decides all texels from `first` to `last`, which lie within the map, by the blocks of one level: 1 if all of them are
// certainly lit, 0 if all are certainly shadowed, UNDECIDED otherwise. The texels are tested against a plane of the
// given slope (depth per texel) with the depth `reference` at the centre of `first`. The true references may differ
// from this plane by `rounding`, and may lie nearer to the light by up to `drop`.
int decideBlocks(sampler2D blocks, int level, ivec2 first, ivec2 last, float reference, vec2 plane, float drop, float rounding) {
  int size = 8 << level;
  ivec2 a = first / size, b = last / size;
  bool lit = true, dark = true;
  for (int y = a.y; y <= b.y; ++y) {
    for (int x = a.x; x <= b.x; ++x) {
      vec4 v = texelFetch(blocks, ivec2(x, y), level);
      DepthBounds bounds = DepthBounds(v.xy, v.z, v.w);
      ivec2 corner = size * ivec2(x, y);
      vec2 low = vec2(max(first, corner)), high = vec2(min(last, corner + size - 1));
      vec2 middle = 0.5 * (low + high), half_size = 0.5 * (high - low);
      vec2 from_block = middle - (vec2(corner) + 0.5 * float(size) - 0.5);
      vec2 turn = abs(plane - bounds.slope), reach = abs(bounds.slope);
      float depth = reference + dot(plane, middle - vec2(first));
      float stored = dot(bounds.slope, from_block);
      float off = rounding + 5e-7 * dot(abs(plane) + reach, vec2(size));
      float slack = dot(turn, half_size) + off;
      lit = lit && depth + slack <= stored + bounds.low;
      // A texel at the far end of the range never shadows, whatever the reference.
      float farthest = stored + bounds.high + dot(reach, half_size);
      bool empty_texels = reach == vec2(0.0) ? farthest >= 1.0 : farthest + off >= 1.0;
      dark = dark && depth - drop - slack > stored + bounds.high && !empty_texels;
    }
  }
  return lit ? 1 : dark ? 0 : UNDECIDED;
}

// Decides a whole kernel; see decideBlocks.
int decideKernel(sampler2D blocks, PcfKernel k, float drop, int w, ivec2 map_size) {
  ivec2 first = k.base, last = k.base + w;
  if (any(lessThan(first, ivec2(0))) || any(greaterThanEqual(last, map_size))) return UNDECIDED;
  // Blocks have at least w + 1 texels per side, so the kernel touches at most 2 x 2 of them.
  int level = w < 8 ? 0 : w < 16 ? 1 : w < 32 ? 2 : 3;
  // The kernel sums its references in another order, so the bound allows for the difference in rounding.
  return decideBlocks(blocks, level, first, last, k.reference, k.slope, drop, 2.5e-7);
}

#endif
