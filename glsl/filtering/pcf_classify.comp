#version 460
// Decides the tiles whose kernels are all lit or all in shadow according to the depth bounds of blocks, and lists the others.
// The bounds are conservative, so the result is the same as that of filtering every pixel.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "common/soft_receiver.glsl"
#include "lib/pcf.glsl"
#include "common/pcf_bounds.glsl"
#include "common/hsm.glsl"
#include "common/tile_classes.glsl"
#include "pcf_receiver.glsl"
#include "common/tiles.glsl"

layout(constant_id = 0) const int WIDTH = 3;

layout(local_size_x = 8, local_size_y = 8) in; // one thread a tile

layout(binding = 3) uniform sampler2D blocks; // depth_bounds.comp; level l holds blocks of 8 * 2^l texels
layout(binding = 4) writeonly uniform image2D visibility;
layout(binding = 5, scalar) buffer TileList {
  uint groups[3];
  uint count;
  uint tiles[];
} list;

// Decides the pixels of a tile one by one: normals from depth have no bounds over a tile. Returns true if one is left.
bool decidePixels(ivec2 corner) {
  bool is_open = false;
  [[dont_unroll]] for (int i = 0; i < (view.normal_encoding == NORMAL_NONE ? 64 : 0); ++i) {
    ivec2 pixel = corner + ivec2(i & 7, i >> 3);
    if (any(greaterThanEqual(pixel, ivec2(view.size)))) continue;
    PcfKernel kernel;
    float decided;
    bool is_known = pcfReceiver(pixel, WIDTH, kernel, decided);
    if (!is_known) {
      int decision = decideKernel(blocks, kernel, 0.0, WIDTH, ivec2(view.map_size));
      is_known = decision != UNDECIDED;
      decided = float(decision);
    }
    if (is_known) imageStore(visibility, pixel, vec4(decided));
    is_open = is_open || !is_known;
  }
  return is_open;
}

void main() {
  ivec2 tile = ivec2(gl_GlobalInvocationID.xy), corner = 8 * tile;
  int found = classifyKernels(blocks, corner, push.normal_offset, push.depth_bias, 0.0, FIXED, float(WIDTH / 2 + 1));
  // Decided tiles lie in the image (tileReceivers).
  [[dont_unroll]] for (int i = 0; i < (found == HSM_PENUMBRA ? 0 : 64); ++i) {
    imageStore(visibility, corner + ivec2(i & 7, i >> 3), vec4(found));
  }
  bool is_open = decidePixels(corner) || view.normal_encoding != NORMAL_NONE && found == HSM_PENUMBRA;
  if (!is_open || any(greaterThanEqual(corner, ivec2(view.size)))) return;
  uint i = atomicAdd(list.count, 1);
  list.tiles[i] = packTile(uvec2(tile));
  if (i < MAX_TILE_GROUPS) atomicMax(list.groups[0], i + 1);
}
