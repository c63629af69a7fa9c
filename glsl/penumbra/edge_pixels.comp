#version 460
// Lists the pixels at a shadow edge in the listed tiles, whatever surface their neighbours lie on. A thread works on a
// quad of 2 x 2 pixels.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "edge_seeds.glsl"
#include "edge_pixels.glsl"

layout(local_size_x = 64) in;

layout(binding = 4, scalar) readonly buffer TileList {
  uint groups[3];
  uint count;
  uint tiles[];
} list;
layout(binding = 5, scalar) buffer PixelList {
  uint groups[3];
  uint count;
  uint pixels[];
} pixels;

// Quads per tile, and along its side.
const uint QUADS = 16, SIDE = 4;

// Pixels of a quad for which edgeNeighbours is not 0, as bits x + 4 y of a square of 4 x 4 pixels with the quad in its
// middle.
uint edgePixels(ivec2 quad) {
  uint lit = 0;
  for (int i = 0; i < 4; ++i) {
    // Gather order: (0, 1), (1, 1), (1, 0), (0, 0). Outside the image the sampler's border is lit.
    ivec2 corner = 2 * ivec2(i & 1, i >> 1);
    uvec4 block = uvec4(greaterThan(textureGather(hard, vec2(quad + corner) / vec2(view.size)), vec4(0.5)));
    lit |= (block.w | block.z << 1 | block.x << 4 | block.y << 5) << (corner.x + 4 * corner.y);
  }
  uint dark = ~lit, beside_lit = lit << 1 | lit >> 1, beside_dark = dark << 1 | dark >> 1;
  uint middle = 0x660u;
  if (!AT_PIXELS) return lit & (beside_dark | dark << 4 | dark >> 4) & middle;
  beside_lit |= lit;
  beside_dark |= dark;
  return (lit & (beside_dark | beside_dark << 4 | beside_dark >> 4) | dark & (beside_lit | beside_lit << 4 | beside_lit >> 4)) &
         middle;
}

void main() {
  uint threads = 64 * gl_NumWorkGroups.x, total = QUADS * list.count;
  for (uint i = gl_GlobalInvocationID.x; i < total; i += threads) {
    ivec2 quad = TILE * unpackTile(list.tiles[i / QUADS]) + 2 * ivec2(i % SIDE, i / SIDE % SIDE);
    uint at_edge = edgePixels(quad);
    if (quad.x + 1 >= view.size.x) at_edge &= 0x220u;
    if (quad.y + 1 >= view.size.y) at_edge &= 0x060u;
    if (at_edge == 0 || any(greaterThanEqual(quad, ivec2(view.size)))) continue;
    // A driver may turn the additions of a subgroup into one.
    uint found = bitCount(at_edge), index = atomicAdd(pixels.count, found);
    atomicMax(pixels.groups[0], min((index + found + 63) / 64, MAX_TILE_GROUPS));
    for (; at_edge != 0; at_edge &= at_edge - 1, ++index) {
      int bit = findLSB(at_edge);
      pixels.pixels[index] = packTile(uvec2(quad + ivec2(bit & 3, bit >> 2) - 1));
    }
  }
}
