#version 460
// One step of the search for the nearest edge in the world, for one pixel of every block of 4 x 4. It takes over the
// labels of blocks `step` away if their edges are nearer; steps are halved down to 1. This is jump flooding (Rong, Tan
// 2006), but it starts from labels that are already right in the image, measures in the world, and stays on surfaces.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "edge_seeds.glsl"
#include "nearest_edge.glsl"

layout(constant_id = 1) const bool FIRST = false; // labels are those of the distance transform, one per pixel

layout(local_size_x = 64) in;

layout(binding = 4) uniform usampler2D labels;
layout(binding = 5) writeonly uniform uimage2D relaxed_labels; // one per block
layout(binding = 6, scalar) readonly buffer TileList {
  uint groups[3];
  uint count;
  uint tiles[];
} list;

// Blocks per tile.
const uint BLOCKS = 4;

uint labelAt(ivec2 block) {
  if (!FIRST) return blockLabel(labels, block, BLOCK);
  ivec2 inside = clamp(block, ivec2(0), blockCount(BLOCK) - 1);
  uint label = texelFetch(labels, blockPixel(inside, BLOCK), 0).x;
  return block == inside ? label : NO_SEED;
}

void workOn(ivec2 block) {
  ivec2 pixel = blockPixel(block, BLOCK);
  Receiver p = receiverAt(pixel);
  Nearest nearest = Nearest(SOFT && (MEET_NEAREST || FILTER_IN_WORLD) ? 3.0e38 : blockReachSquared(1.0), NO_SEED);
  if (p.surface) {
    Place at = placeAt(pixel, p);
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) consider(labelAt(block + push.step * ivec2(x, y)), at, true, nearest);
    }
  }
  imageStore(relaxed_labels, block, uvec4(nearest.label));
}

void main() {
  uint threads = 64 * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < BLOCKS * list.count; i += threads) {
    ivec2 block = 2 * unpackTile(list.tiles[i / BLOCKS]) + ivec2(i & 1, i >> 1 & 1);
    if (all(lessThan(block, blockCount(BLOCK)))) workOn(block);
  }
}
