// Packs a mask into the vertical bit mask of edt.glsl. The includer declares the image.
#ifndef EDGESHADE_EDT_PACK
#define EDGESHADE_EDT_PACK
#include "edt.glsl"

layout(local_size_x = 64) in;

layout(binding = 1, scalar) writeonly buffer SeedBits { uint seed_bits[]; };

bool isSeed(ivec2 pixel);

void main() {
  uint x = gl_GlobalInvocationID.x, block = gl_GlobalInvocationID.y;
  if (x >= push.size.x || 32 * block >= push.size.y) return;
  uint word = 0;
  for (uint i = 0; i < min(32, push.size.y - 32 * block); i++) {
    if (isSeed(ivec2(x, 32 * block + i))) word |= 1u << i;
  }
  seed_bits[x + push.size.x * block] = word;
}

#endif
