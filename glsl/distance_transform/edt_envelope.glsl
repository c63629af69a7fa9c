// Finds the seeds that are nearest to any pixel of a stretch of a row, in order: the lower envelope of the columns'
// parabolas (Meijster, Roerdink, Hesselink 2000; Felzenszwalb, Huttenlocher 2012), or "proximate points" (Cao, Tang,
// Mohamed, Tan 2010). A site is a seed's label and the first pixel whose nearest seed it is.
// Include after edt.glsl and after the functions loadSite and storeSite, which keep the sites of a thread.
#ifndef EDGESHADE_EDT_ENVELOPE
#define EDGESHADE_EDT_ENVELOPE

layout(binding = 0) uniform usampler2D columns; // edt_columns.comp
layout(binding = 1, scalar) readonly buffer Live { uint live[]; };

// Stores the sites of the columns from..to of row y that own pixels of begin..end; both ranges are half open. Returns
// their number, and the last one in `top`. A site without such a pixel can be left out: each of the pixels has a nearer
// one.
uint envelope(uint y, uint from, uint to, uint begin, uint end, out uvec2 top) {
  uint tiles = (push.size.x + 31) / 32, block = y / 32, count = 0;
  top = uvec2(NO_SEED, begin);
  for (uint tile = from / 32; 32 * tile < to; tile++) {
    uint bits = live[tile + tiles * block];
    if (32 * tile < from) bits &= 0xffffffffu << (from - 32 * tile);
    if (to - 32 * tile < 32) bits &= (1u << (to - 32 * tile)) - 1;
    while (bits != 0) {
      uint x = 32 * tile + findLSB(bits);
      bits &= bits - 1;
      int offset = columnOffset(texelFetch(columns, ivec2(x, block), 0).xy, y & 31);
      if (uint(abs(offset)) > push.radius) continue;
      uint label = x | uint(int(y) + offset) << 16;
      // A site whose first pixel is nearer to the new seed has lost all its pixels.
      while (count > 0) {
        if (!isNearer(top.x, label, top.y, y)) break;
        if (--count > 0) top = loadSite(count - 1);
      }
      uint start = count > 0 ? uint(max(firstNearer(top.x, label, y), int(begin))) : begin;
      if (start >= end) continue;
      top = uvec2(label, start);
      storeSite(count++, top);
    }
  }
  return count;
}

#endif
