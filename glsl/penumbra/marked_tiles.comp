#version 460
// Lists the tiles that edge_seeds.comp or seed_width.comp has marked, or all tiles.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "common/tiles.glsl"

layout(constant_id = 0) const bool ALL = false; // list every tile

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) readonly buffer Marks { uint marks[]; };
layout(binding = 1, scalar) buffer TileList {
  uint groups[3];
  uint count;
  uint tiles[];
} list;

// Dispatch sizes for the 4 blocks and the 16 quads of each tile, at 64 threads per workgroup.
layout(binding = 2, scalar) buffer BlockGroups { uint block_groups[3]; };
layout(binding = 3, scalar) buffer QuadGroups { uint quad_groups[3]; };

// Arguments of the same dispatches over blocks, for pairs of steps that only wide penumbrae need.
layout(binding = 4, scalar) buffer Coarse {
  uint coarse_groups[3][3];
  int farthest; // reach of the widest penumbra, pixels
};

// Reach, in pixels, up to which a pair is not needed: that of the distance transform's labels, of the first and the last
// step, and of the finer pairs.
const int REACH_WITHOUT[3] = int[](44 + 4 * (16 + 8 + 4 + 2), 44 + 4 * (4 + 2), 44);

layout(push_constant, scalar) uniform Push {
  uvec2 tiles; // number along both axes
} push;

shared uint open;
shared uint first;

void main() {
  uvec2 tile = gl_GlobalInvocationID.xy;
  // A workgroup covers one block of marks.
  uint block = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x, bit = gl_LocalInvocationIndex;
  bool marked = ALL || (marks[2 * block + (bit >> 5)] >> (bit & 31) & 1u) != 0;
  bool wanted = marked && all(lessThan(tile, push.tiles));
  if (gl_LocalInvocationIndex == 0) open = 0;
  barrier();
  uint index;
  if (wanted) index = atomicAdd(open, 1);
  barrier();
  if (gl_LocalInvocationIndex == 0 && open > 0) {
    first = atomicAdd(list.count, open);
    atomicMax(list.groups[0], min(first + open, MAX_TILE_GROUPS));
    uint groups = min((first + open + 15) / 16, MAX_TILE_GROUPS);
    atomicMax(block_groups[0], groups);
    for (int i = 0; i < 3; ++i) {
      if (farthest > REACH_WITHOUT[i]) atomicMax(coarse_groups[i][0], groups);
    }
    atomicMax(quad_groups[0], min((first + open + 3) / 4, MAX_TILE_GROUPS));
  }
  barrier();
  if (wanted) list.tiles[first + index] = packTile(tile);
}
