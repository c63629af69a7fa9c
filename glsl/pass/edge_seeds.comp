#version 460
// Finds the shadow edges in the listed tiles of an image of hard shadows: pixels that differ from one of their 8 neighbours
// on the same surface, and the points half-way to those neighbours, through which the edge runs. Marks all tiles that a
// penumbra around them may reach.
// Macedo, Apolinario (2018), algorithm 1; the paper takes neighbours on any surface (ANY_SURFACE), and the pixels' own
// centres on both sides for the edge (AT_PIXELS), which leaves a plateau two pixels wide.
#extension GL_GOOGLE_include_directive : require
#include "edge_seeds.glsl"

layout(constant_id = 1) const bool ANY_SURFACE = false;
layout(constant_id = 2) const bool AT_PIXELS = false;

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 3) uniform sampler2D hard;
layout(binding = 4, scalar) readonly buffer TileList {
  uint groups[3];
  uint count;
  uint tiles[];
} list;
layout(binding = 5) writeonly uniform uimage2D seeds;
layout(binding = 6, scalar) buffer SeedBits { uint seed_bits[]; }; // a word a column and 32 rows, bit y % 32
layout(binding = 7, scalar) buffer Marks { uint marks[]; };        // a bit a tile, 8 x 8 of them in two words

const int MARKS = 8;

shared uint columns[TILE]; // which rows have a seed
shared uint nearest_bits;  // eye depth of the nearest seed; positive floats order like their bits

bool isSurface(ivec2 pixel) {
  return all(greaterThanEqual(pixel, ivec2(0))) && all(lessThan(pixel, ivec2(view.size))) && depthAt(pixel) != view.far_depth;
}

bool onSameSurface(Receiver p, ivec2 pixel, Receiver q, ivec2 other) {
  if (!PLANES) return sameDepth(p.position.z, q.position.z, push.tolerance);
  vec3 apart = q.position - p.position;
  float pixels = length(vec2(other - pixel)), width = min(pixelWidth(p.position), pixelWidth(q.position));
  return nearPlane(p.normal, apart, pixels, width, push.tolerance) && nearPlane(q.normal, apart, pixels, width, push.tolerance);
}

ivec2 neighbour(int i) {
  int row = int(i > 2) + int(i > 5); // a division is slow on some devices
  return ivec2(i - 3 * row, row) - 1;
}

// The neighbours whose hard visibility is another: bit i for neighbour(i). Outside the image the sampler's border is lit;
// receivers there are none.
uint differingNeighbours(ivec2 pixel, float own) {
  uint differing = 0;
  // Four blocks of 2 x 2 that meet in the pixel; at the common corner of a block no rounding can pick another. Gather order:
  // (0, 1), (1, 1), (1, 0), (0, 0).
  for (int y = 0; y <= 1; ++y) {
    for (int x = 0; x <= 1; ++x) {
      vec4 block = textureGather(hard, vec2(pixel + ivec2(x, y)) / vec2(view.size));
      uint bits = uint(block.w != own) | uint(block.z != own) << 1 | uint(block.x != own) << 3 | uint(block.y != own) << 4;
      differing |= bits << (x + 3 * y);
    }
  }
  return differing;
}

// False if the pixel is no seed.
bool findSeed(ivec2 pixel, out uvec4 seed, out float depth) {
  if (!isSurface(pixel)) return false;
  float own = texelFetch(hard, pixel, 0).x;
  // The points of both sides are the same, so one side will do.
  uint differing = own > 0.5 || AT_PIXELS ? differingNeighbours(pixel, own) : 0;
  // Pairs across a corner say nothing new where one across a side is there; where none is, the edge also runs between two
  // other pixels.
  const uint SIDES = 0xaau, CORNERS = 0x145u;
  Receiver p;
  if (differing != 0) p = receiverAt(pixel);
  vec3 apart = vec3(0.0), corner_apart = vec3(0.0);
  int count = 0, corner_count = 0;
  if (!AT_PIXELS) differing &= SIDES;
  while (differing != 0) {
    int i = findLSB(differing);
    differing &= differing - 1;
    ivec2 other = pixel + neighbour(i);
    if (!isSurface(other)) continue;
    Receiver q = receiverAt(other);
    if (!ANY_SURFACE && !onSameSurface(p, pixel, q, other)) continue;
    bool corner = (CORNERS >> i & 1u) != 0;
    if (corner) {
      corner_apart += q.position - p.position;
      ++corner_count;
    } else {
      apart += q.position - p.position;
      ++count;
    }
  }
  if (count == 0) {
    apart = corner_apart;
    count = corner_count;
  }
  if (count == 0) return false;
  // The middle of the middles: on a straight edge it lies on the line through them.
  float half_way = AT_PIXELS ? 0.0 : 0.5 / float(count);
  seed = packSeed(p.position + half_way * apart, p.normal);
  depth = eyeDepth(p.position);
  return true;
}

void mark(ivec2 first, ivec2 last) {
  ivec2 blocks = (tileCount() + MARKS - 1) / MARKS;
  for (int y = first.y / MARKS; y <= last.y / MARKS; ++y) {
    // Rows of marks of this block that are in reach, then the columns of one row.
    ivec2 rows = clamp(ivec2(first.y, last.y) - MARKS * y, 0, MARKS - 1);
    for (int x = first.x / MARKS; x <= last.x / MARKS; ++x) {
      ivec2 columns = clamp(ivec2(first.x, last.x) - MARKS * x, 0, MARKS - 1);
      uint row = (2u << columns.y) - (1u << columns.x);
      uint bits[2] = {0, 0};
      for (int r = rows.x; r <= rows.y; ++r) bits[r >> 2] |= row << 8 * (r & 3);
      if (bits[0] != 0) atomicOr(marks[2 * (y * blocks.x + x)], bits[0]);
      if (bits[1] != 0) atomicOr(marks[2 * (y * blocks.x + x) + 1], bits[1]);
    }
  }
}

void workOn(ivec2 tile) {
  uvec2 at = gl_LocalInvocationID.xy;
  ivec2 pixel = tile * TILE + ivec2(at);
  if (gl_LocalInvocationIndex < TILE) columns[gl_LocalInvocationIndex] = 0;
  if (gl_LocalInvocationIndex == 0) nearest_bits = 0x7f7fffffu;
  barrier();
  uvec4 seed;
  float depth;
  if (all(lessThan(pixel, ivec2(view.size))) && findSeed(pixel, seed, depth)) {
    imageStore(seeds, pixel, seed);
    atomicOr(columns[at.x], 1u << at.y);
    atomicMin(nearest_bits, floatBitsToUint(depth));
  }
  barrier();
  // Tiles do not straddle words.
  if (at.y == 0 && columns[at.x] != 0) {
    atomicOr(seed_bits[pixel.x + view.size.x * (pixel.y / 32)], columns[at.x] << (pixel.y & 31));
  }
  if (gl_LocalInvocationIndex == 0 && nearest_bits != 0x7f7fffffu) {
    ivec2 first, last;
    // The filter reads half its width beyond what it changes.
    tilesInReach(tile, penumbraReach() + 0.5 * push.filter_width, uintBitsToFloat(nearest_bits), first, last);
    mark(first, last);
  }
  barrier();
}

void main() {
  for (uint i = gl_WorkGroupID.x; i < list.count; i += gl_NumWorkGroups.x) workOn(unpackTile(list.tiles[i]));
}
