#version 460
// Joins the blocks of 32 rows of every column: finds the next seed above and below each block. This is phase 1 of the
// Parallel Banding Algorithm (Cao, Tang, Mohamed, Tan 2010) with bands of 32 rows, in which bit arithmetic replaces the
// sweep.
#extension GL_GOOGLE_include_directive : require
#include "edt.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer SeedBits { uint seed_bits[]; };
// An image with texels (x, block): a CPU driver fetches texels faster than entries of a buffer.
layout(binding = 1, rg32ui) uniform uimage2D columns;

void main() {
  uint x = gl_GlobalInvocationID.x;
  if (x >= push.size.x) return;
  uint blocks = (push.size.y + 31) / 32;
  uint first = gl_GlobalInvocationID.y * push.span, end = min(first + push.span, blocks);
  if (first >= end) return;

  uint up = FAR;
  for (uint k = 0; k < first && 32 * k < push.radius; k++) {
    uint word = seed_bits[x + push.size.x * (first - 1 - k)];
    if (word != 0) {
      up = 32 * (k + 1) - findMSB(word);
      break;
    }
  }
  for (uint b = first; b < end; b++) {
    uint word = seed_bits[x + push.size.x * b];
    imageStore(columns, ivec2(x, b), uvec4(word, up <= push.radius ? up : FAR, 0, 0));
    up = word != 0 ? 32 - findMSB(word) : min(up + 32, FAR);
  }

  uint down = FAR;
  for (uint k = 0; k + end < blocks && 32 * k < push.radius; k++) {
    uint word = seed_bits[x + push.size.x * (end + k)];
    if (word != 0) {
      down = 32 * k + 1 + findLSB(word);
      break;
    }
  }
  for (uint b = end; b-- > first;) {
    uvec2 column = imageLoad(columns, ivec2(x, b)).xy;
    column.y |= (down <= push.radius ? down : FAR) << 16;
    imageStore(columns, ivec2(x, b), uvec4(column, 0, 0));
    down = column.x != 0 ? 1 + findLSB(column.x) : min(down + 32, FAR);
  }
}
