#version 460
// Lists the tiles that hold both lit and shadowed pixels of a hard-shadow image, counting a ring of pixels around the
// tile. A thread works on one tile.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "edge_seeds.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 3) uniform sampler2D hard; // lit outside the image
layout(binding = 4, scalar) buffer TileList {
  uint groups[3];
  uint count;
  uint tiles[];
} list;

shared uint open;
shared uint first;

void main() {
  ivec2 tile = ivec2(gl_GlobalInvocationID.xy);
  bool mixed = false;
  if (all(lessThan(tile, tileCount()))) {
    vec4 darkest = vec4(1.0), lightest = vec4(0.0);
    for (int i = 0; i < 25; ++i) {
      ivec2 corner = tile * TILE + 2 * ivec2(i % 5, i / 5);
      // Rounding cannot select other pixels at the common corner of the four.
      vec4 block = textureGather(hard, vec2(corner) / vec2(view.size));
      darkest = min(darkest, block);
      lightest = max(lightest, block);
    }
    darkest.xy = min(darkest.xy, darkest.zw);
    lightest.xy = max(lightest.xy, lightest.zw);
    mixed = min(darkest.x, darkest.y) < 0.5 && max(lightest.x, lightest.y) > 0.5;
  }
  if (gl_LocalInvocationIndex == 0) open = 0;
  barrier();
  uint index;
  if (mixed) index = atomicAdd(open, 1);
  barrier();
  if (gl_LocalInvocationIndex == 0 && open > 0) {
    first = atomicAdd(list.count, open);
    // Four tiles for a workgroup of edge_pixels.comp.
    atomicMax(list.groups[0], min((first + open + 3) / 4, MAX_TILE_GROUPS));
  }
  barrier();
  if (mixed) list.tiles[first + index] = packTile(tile);
}
