#version 460
// One step of the search for the nearest line of an edge, for one pixel of every block of 4 x 4, as in nearest_block.comp.
// The last step lists the blocks that a penumbra may reach; line_quads.comp works on their pixels.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "edge_seeds.glsl"
#include "nearest_edge.glsl"
#include "nearest_line.glsl"

layout(constant_id = 1) const bool FIRST = false; // labels are those of the distance transform, one per pixel
layout(constant_id = 2) const bool LAST = false;  // list blocks
layout(constant_id = 6) const bool ALL = false;   // list all blocks; those out of reach are marked so

layout(local_size_x = 64) in;

layout(binding = 4) uniform usampler2D labels;
layout(binding = 5) writeonly uniform uimage2D relaxed_labels; // one per block
layout(binding = 6, scalar) readonly buffer TileList {
  uint groups[3];
  uint count;
  uint tiles[];
} list;
layout(binding = 7) uniform usampler2D pixel_labels; // of the distance transform
layout(binding = 8, scalar) buffer BlockList {
  uint block_groups[3];
  uint block_count;
  uint blocks[];
};
// Blocks around which some edges lie on other surfaces, so that more candidates are wanted.
layout(binding = 9, scalar) buffer MixedList {
  uint mixed_groups[3];
  uint mixed_count;
  uint mixed_blocks[];
};

// Blocks per tile.
const uint BLOCKS = 4;

const uint OUT_OF_REACH = 0x8000u; // bit of a listed block's x

// Work that a block needs: none, a plain search, or one that considers several surfaces.
const uint NOTHING = 0, PLAIN = 1, MIXED = 2;

struct Search {
  Place at;
  Nearest nearest;
  float around; // largest distance in the world from the block's pixel to another on its surface
  bool off;     // some candidate lies on another surface
};

// Returns whether the candidate may reach the block.
bool considerLine(uint candidate, inout Search search) {
  bool is_label = candidate != NO_SEED;
  ivec2 pixel = is_label ? ivec2(candidate & 0xffffu, candidate >> 16) : ivec2(0);
  uvec3 bits = seedAt(pixel);
  // The steps before the last carry labels: points are enough for them.
  Seed seed = Seed(seedPoint(pixel, bits), seedNormal(bits), vec3(0.0));
  if (LAST) seed = unpackSeed(pixel, bits);
  vec2 width = widthOf(pixel);
  float world_reach = worldReach(width), most = world_reach + search.around;
  bool reaches = is_label && mayReach(pixel, eyeDepth(seed.point), search.at.pixel, world_reach);
  vec3 apart = seed.point - search.at.p.position, closest = LAST ? toLine(apart, seed.along, halfLine(seed)) : apart;
  float squared = lineDistanceSquared(search.at, closest, width);
  bool on_surface = onSurface(search.at, apart, seed.normal, pixel);
  search.off = search.off || (reaches && !on_surface);
  bool nearer = reaches && on_surface && squared < search.nearest.squared && dot(closest, closest) < most * most;
  search.nearest.squared = nearer ? squared : search.nearest.squared;
  search.nearest.label = nearer ? candidate : search.nearest.label;
  return reaches;
}

uint labelAt(ivec2 block) {
  if (!FIRST) return blockLabel(labels, block, BLOCK);
  ivec2 inside = clamp(block, ivec2(0), blockCount(BLOCK) - 1);
  uint label = texelFetch(labels, blockPixel(inside, BLOCK), 0).x;
  return block == inside ? label : NO_SEED;
}

uint workOn(ivec2 block) {
  ivec2 pixel = blockPixel(block, BLOCK);
  Receiver p = receiverAt(pixel);
  // The block's pixels lie farther away on a surface that is seen at an angle.
  float facing = dot(p.normal, normalize(p.position));
  float around = float(LINE_PIXELS + BLOCK_PIXELS) * pixelWidth(p.position) / max(abs(facing), 0.05);
  Search search = Search(placeAt(pixel, p), nothing(), around, false);
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) considerLine(labelAt(block + push.step * ivec2(x, y)), search);
  }
  if (!p.surface) search.nearest.label = NO_SEED;
  imageStore(relaxed_labels, block, uvec4(search.nearest.label));
  if (!LAST) return NOTHING;
  uint nearest = search.nearest.label;
  // The edge nearest in the image may lie on the surface of other pixels of the block.
  bool reaches = considerLine(texelFetch(pixel_labels, pixel, 0).x, search) && (search.off || !p.surface);
  if (nearest == NO_SEED && !reaches) return NOTHING;
  return search.off || !p.surface ? MIXED : PLAIN;
}

void main() {
  uint threads = 64 * gl_NumWorkGroups.x, total = BLOCKS * list.count;
  for (uint i = gl_GlobalInvocationID.x; i < total; i += threads) {
    ivec2 block = 2 * unpackTile(list.tiles[i / BLOCKS]) + ivec2(i & 1, i >> 1 & 1);
    if (any(greaterThanEqual(block, blockCount(BLOCK)))) continue;
    uint work = workOn(block);
    if (!LAST) continue;
    if (ALL && work == NOTHING) {
      work = PLAIN;
      block.x |= int(OUT_OF_REACH);
    }
    // A driver may turn the additions of a subgroup into one.
    if (work == PLAIN) {
      uint index = atomicAdd(block_count, 1);
      atomicMax(block_groups[0], min(index / 16 + 1, MAX_TILE_GROUPS));
      blocks[index] = packTile(uvec2(block));
    }
    if (work == MIXED) {
      uint index = atomicAdd(mixed_count, 1);
      atomicMax(mixed_groups[0], min(index / 16 + 1, MAX_TILE_GROUPS));
      mixed_blocks[index] = packTile(uvec2(block));
    }
  }
}
