#version 460
// Packs a mask of one byte per pixel into the vertical bit mask of edt.glsl. Bytes other than 0 are seeds; rows are
// padded to whole words. A thread packs the columns of WORDS words in a block of 32 rows.
#extension GL_GOOGLE_include_directive : require
#include "edt.glsl"

layout(local_size_x = 64) in;

// 1, or 4 if rows consist of groups of 16 bytes: a CPU driver reads four words in little more time than one.
layout(constant_id = 0) const uint WORDS = 1;

layout(binding = 0, scalar) readonly buffer Mask { uvec4 mask[]; };
layout(binding = 1, scalar) writeonly buffer SeedBits { uvec4 seed_bits[]; };

// The words of row y, or 0 beyond the image.
uvec4 readWords(uint word, uint y) {
  if (y >= push.size.y) return uvec4(0);
  uint i = word + (push.size.x + 3) / 4 * y;
  return WORDS == 4 ? mask[i / 4] : uvec4(mask[i / 4][i % 4], 0, 0, 0);
}

// Spreads the bytes of a word over four columns.
uvec4 spread(uint bytes, uint rows) { return (uvec4(bytes) >> uvec4(0, 8, 16, 24) & 0xff) << rows; }

void storeWords(uint word, uint block, uvec4 bits) {
  uint i = 4 * word + push.size.x * block;
  if (WORDS == 4) seed_bits[i / 4] = bits;
  else for (uint k = 0; k < min(4, push.size.x - 4 * word); k++) seed_bits[(i + k) / 4][(i + k) % 4] = bits[k];
}

void main() {
  uint word = WORDS * gl_GlobalInvocationID.x, block = gl_GlobalInvocationID.y;
  if (4 * word >= push.size.x || 32 * block >= push.size.y) return;
  uvec4 a = uvec4(0), b = a, c = a, d = a;
  for (uint rows = 0; rows < 32; rows += 8) {
    // The top bit of each byte, moved down by one per row.
    uvec4 seeds = uvec4(0);
    for (uint i = 0; i < 8; i++) {
      uvec4 words = readWords(word, 32 * block + rows + i);
      seeds = seeds >> 1 | ((words & 0x7f7f7f7f) + 0x7f7f7f7f | words) & 0x80808080u;
    }
    a |= spread(seeds.x, rows);
    b |= spread(seeds.y, rows);
    c |= spread(seeds.z, rows);
    d |= spread(seeds.w, rows);
  }
  storeWords(word, block, a);
  if (WORDS == 4) {
    storeWords(word + 1, block, b);
    storeWords(word + 2, block, c);
    storeWords(word + 3, block, d);
  }
}
