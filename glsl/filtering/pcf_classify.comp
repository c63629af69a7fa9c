#version 460
// Decides the pixels whose whole kernel is lit or in shadow according to the depth bounds of blocks, and lists the
// tiles with any other pixel. The bounds are conservative, so the result is the same as that of filtering every pixel.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "lib/pcf.glsl"
#include "common/pcf_bounds.glsl"
#include "pcf_receiver.glsl"
#include "common/tiles.glsl"

layout(constant_id = 0) const int WIDTH = 3;

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 3) uniform sampler2D blocks; // depth_bounds.comp; level l holds blocks of 8 * 2^l texels
layout(binding = 4) writeonly uniform image2D visibility;
layout(binding = 5, scalar) buffer TileList {
  uint groups[3];
  uint count;
  uint tiles[];
} list;

shared bool undecided;

// Returns true if the visibility is known without filtering; `decided` then holds it.
bool classify(ivec2 pixel, out float decided) {
  PcfKernel kernel;
  if (pcfReceiver(pixel, WIDTH, kernel, decided)) return true;
  int decision = decideKernel(blocks, kernel, 0.0, WIDTH, ivec2(view.map_size));
  decided = float(decision);
  return decision != UNDECIDED;
}

void main() {
  if (gl_LocalInvocationIndex == 0) undecided = false;
  barrier();
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (all(lessThan(pixel, ivec2(view.size)))) {
    float decided;
    if (classify(pixel, decided)) imageStore(visibility, pixel, vec4(decided));
    else undecided = true;
  }
  barrier();
  if (gl_LocalInvocationIndex == 0 && undecided) {
    uint i = atomicAdd(list.count, 1);
    list.tiles[i] = packTile(gl_WorkGroupID.xy);
    if (i < MAX_TILE_GROUPS) atomicMax(list.groups[0], i + 1);
  }
}
