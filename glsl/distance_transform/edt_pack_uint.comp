#version 460
// Packs an unsigned integer mask into the vertical bit mask of edt.glsl. Pixels other than 0 are seeds.
#extension GL_GOOGLE_include_directive : require
#include "edt.glsl"

layout(local_size_x = 64) in;

layout(binding = 0) uniform usampler2D mask;
layout(binding = 1, scalar) writeonly buffer SeedBits { uint seed_bits[]; };

void main() {
  uint x = gl_GlobalInvocationID.x, block = gl_GlobalInvocationID.y;
  if (x >= push.size.x || 32 * block >= push.size.y) return;
  uint word = 0;
  for (uint i = 0; i < min(32, push.size.y - 32 * block); i++) {
    if (texelFetch(mask, ivec2(x, 32 * block + i), 0).x != 0) word |= 1u << i;
  }
  seed_bits[x + push.size.x * block] = word;
}
