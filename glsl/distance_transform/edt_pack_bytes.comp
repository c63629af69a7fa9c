#version 460
// Packs a mask of one byte per pixel into the vertical bit mask of edt.glsl. Bytes other than 0 are seeds; rows are
// padded to whole words. A thread packs four columns of a block of 32 rows.
#extension GL_GOOGLE_include_directive : require
#include "edt.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Mask { uint mask[]; };
layout(binding = 1, scalar) writeonly buffer SeedBits { uint seed_bits[]; };

void main() {
  uint quads = (push.size.x + 3) / 4, quad = gl_GlobalInvocationID.x, block = gl_GlobalInvocationID.y;
  if (quad >= quads || 32 * block >= push.size.y) return;
  uvec4 words = uvec4(0);
  for (uint i = 0; i < min(32, push.size.y - 32 * block); i++) {
    uint bytes = mask[quad + quads * (32 * block + i)];
    words |= uvec4(notEqual(uvec4(bytes) & uvec4(0xff, 0xff00, 0xff0000, 0xff000000u), uvec4(0))) << i;
  }
  uint first = 4 * quad + push.size.x * block;
  for (uint i = 0; i < min(4, push.size.x - 4 * quad); i++) seed_bits[first + i] = words[i];
}
