#version 460
// Decides the pixels whose whole kernel is lit or in shadow by the map's block minima and maxima, and lists the
// tiles that hold any other. The result is the same as filtering every pixel: the bounds are conservative.
// Classification as in Guennebaud, Barthe, Paulin (2006).
#extension GL_GOOGLE_include_directive : require
#include "pcf_receiver.glsl"
#include "tiles.glsl"

layout(constant_id = 0) const int WIDTH = 3;

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 3) uniform sampler2D blocks; // min_max.comp; level l holds blocks of 8 * 2^l texels
layout(binding = 4) writeonly uniform image2D visibility;
layout(binding = 5, scalar) buffer TileList {
  uint groups[3];
  uint count;
  uint tiles[];
} list;

shared bool undecided;

// Minimum and maximum over the kernel's texels, or more texels; outside the map the maximum is 1.
vec2 depthRange(ivec2 first, int w, ivec2 map_size) {
  ivec2 last = first + w;
  // The kernel touches at most 2 x 2 blocks of at least w+1 texels.
  int level = WIDTH < 8 ? 0 : WIDTH < 16 ? 1 : WIDTH < 32 ? 2 : 3;
  vec2 range = vec2(1.0, 0.0);
  if (any(lessThan(first, ivec2(0))) || any(greaterThanEqual(last, map_size))) range.y = 1.0;
  ivec2 a = clamp(first, ivec2(0), map_size - 1) >> (3 + level);
  ivec2 b = clamp(last, ivec2(0), map_size - 1) >> (3 + level);
  for (int i = 0; i < 4; ++i) {
    vec2 r = texelFetch(blocks, ivec2((i & 1) == 0 ? a.x : b.x, (i & 2) == 0 ? a.y : b.y), level).xy;
    range = vec2(min(range.x, r.x), max(range.y, r.y));
  }
  return range;
}

// True where the visibility is known without filtering.
bool classify(ivec2 pixel, out float decided) {
  PcfKernel kernel;
  if (pcfReceiver(pixel, WIDTH, kernel, decided)) return true;
  vec2 reference = min(pcfReferenceRange(kernel, WIDTH), vec2(1.0));
  vec2 stored = depthRange(kernel.base, WIDTH, ivec2(view.map_size));
  if (reference.y <= stored.x) {
    decided = 1.0;
    return true;
  }
  decided = 0.0;
  return reference.x > stored.y;
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
