#version 460
// Lists the pixels at a shadow edge in the listed tiles, whatever surface their neighbours lie on.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "edge_seeds.glsl"
#include "edge_pixels.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

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

shared uint open;
shared uint first;

void workOn(ivec2 tile) {
  ivec2 pixel = tile * TILE + ivec2(gl_LocalInvocationID.xy);
  bool wanted = all(lessThan(pixel, ivec2(view.size))) && edgeNeighbours(pixel) != 0;
  if (gl_LocalInvocationIndex == 0) open = 0;
  barrier();
  uint index;
  if (wanted) index = atomicAdd(open, 1);
  barrier();
  if (gl_LocalInvocationIndex == 0 && open > 0) {
    first = atomicAdd(pixels.count, open);
    atomicMax(pixels.groups[0], min((first + open + 63) / 64, MAX_TILE_GROUPS));
  }
  barrier();
  if (wanted) pixels.pixels[first + index] = packTile(uvec2(pixel));
  barrier();
}

void main() {
  for (uint i = gl_WorkGroupID.x; i < list.count; i += gl_NumWorkGroups.x) workOn(unpackTile(list.tiles[i]));
}
