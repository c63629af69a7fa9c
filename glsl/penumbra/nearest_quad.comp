#version 460
// Finds the nearest edge in the world for one pixel of every quad of 2 x 2. It considers the labels of the blocks
// around, then follows the edge from the nearest seed to ever nearer ones.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "edge_seeds.glsl"
#include "nearest_edge.glsl"

layout(local_size_x = 64) in;

layout(binding = 4) uniform usampler2D labels;       // of the distance transform
layout(binding = 5) uniform usampler2D block_labels; // of nearest_block.comp
layout(binding = 6, scalar) readonly buffer TileList {
  uint groups[3];
  uint count;
  uint tiles[];
} list;
layout(binding = 7) writeonly uniform uimage2D quad_labels;

// Quads per tile.
const uint QUADS = 16;

void workOn(ivec2 quad) {
  ivec2 pixel = blockPixel(quad, QUAD);
  Receiver p = receiverAt(pixel);
  Nearest nearest = nothing();
  if (p.surface) {
    Place at = placeAt(pixel, p);
    consider(texelFetch(labels, pixel, 0).x, at, nearest);
    considerAside(labels, 12, 3, at, nearest);
    ivec2 block = pixel / BLOCK;
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) consider(blockLabel(block_labels, block + ivec2(x, y), BLOCK), at, nearest);
    }
    for (int step = 8; step > 0; step /= 2) considerAround(labels, step, at, nearest);
  }
  imageStore(quad_labels, quad, uvec4(squaredShare(nearest) <= blockReachSquared(widthAt(nearest.label)) ? nearest.label : NO_SEED));
}

void main() {
  uint threads = 64 * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < QUADS * list.count; i += threads) {
    ivec2 quad = 4 * unpackTile(list.tiles[i / QUADS]) + ivec2(i & 3, i >> 2 & 3);
    if (all(lessThan(quad, blockCount(QUAD)))) workOn(quad);
  }
}
