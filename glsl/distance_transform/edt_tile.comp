#version 460
// Finds the nearest seeds within a radius of at most 64 pixels in one dispatch, a tile of 32 x 32 pixels per workgroup.
// First it finds, for every column in reach, the rows to the nearest seed from a few words of the bit mask. Then it
// searches from each pixel outwards along the row until no column can be nearer. A tile without seeds in reach ends at
// once.
#extension GL_GOOGLE_include_directive : require
#include "edt.glsl"

const uint TILE = 32, MAX_RADIUS = 64, THREADS = 128;

layout(local_size_x = 128) in;

layout(binding = 0, scalar) readonly buffer SeedBits { uint seed_bits[]; };
layout(binding = 1, r32ui) writeonly uniform uimage2D labels;
layout(binding = 2, r32ui) writeonly uniform uimage2D squared_distances;
layout(binding = 3, scalar) buffer Active { uint active_tiles; };

// Signed rows to the nearest seed of a column, plus 64, in one byte; 255 for none. A word holds rows i, i + 8, i + 16
// and i + 24.
shared uint offsets[8][TILE + 2 * MAX_RADIUS];
shared bool any_seed;

// Seeds of column x in reach of the block of rows, in the form that columnOffset takes.
uvec2 column(uint x, uint block) {
  uint blocks = (push.size.y + 31) / 32;
  uint up = FAR, down = FAR;
  for (uint k = 0; k < block && 32 * k < push.radius && up == FAR; k++) {
    uint word = seed_bits[x + push.size.x * (block - 1 - k)];
    if (word != 0) up = 32 * (k + 1) - findMSB(word);
  }
  for (uint k = 0; block + 1 + k < blocks && 32 * k < push.radius && down == FAR; k++) {
    uint word = seed_bits[x + push.size.x * (block + 1 + k)];
    if (word != 0) down = 32 * k + 1 + findLSB(word);
  }
  if (up > push.radius) up = FAR;
  if (down > push.radius) down = FAR;
  return uvec2(seed_bits[x + push.size.x * block], up | down << 16);
}

// Orders candidates k columns away by squared distance, then y, then x.
uint key(uint row, uint center, int k) {
  uint offset = bitfieldExtract(offsets[row & 7][int(center) + k], int(row & 24), 8);
  int dy = int(offset) - 64;
  return uint(dy * dy + k * k) << 16 | offset << 8 | uint(k + 64);
}

void store(uvec2 p, uint label, uint squared) {
  if (any(greaterThanEqual(p, push.size))) return;
  imageStore(labels, ivec2(p), uvec4(label));
  if (push.squared) imageStore(squared_distances, ivec2(p), uvec4(squared));
}

void main() {
  uint id = gl_LocalInvocationIndex;
  uvec2 corner = gl_WorkGroupID.xy * TILE;
  if (id == 0) any_seed = false;
  barrier();
  for (uint c = id; c < TILE + 2 * push.radius; c += THREADS) {
    int x = int(corner.x + c) - int(push.radius);
    uvec2 seeds = uvec2(0, 0xffffffffu);
    if (x >= 0 && x < int(push.size.x)) seeds = column(uint(x), gl_WorkGroupID.y);
    bool has_seeds = seeds.x != 0 || seeds.y != 0xffffffffu;
    if (has_seeds) any_seed = true;
    for (uint i = 0; i < 8; i++) {
      uint word = 0xffffffffu;
      for (uint j = 0; j < 4 && has_seeds; j++) {
        int offset = columnOffset(seeds, i + 8 * j);
        if (uint(abs(offset)) <= push.radius) word = bitfieldInsert(word, uint(offset + 64), int(8 * j), 8);
      }
      offsets[i][c] = word;
    }
  }
  barrier();
  if (!any_seed) {
    for (uint i = id; i < TILE * TILE; i += THREADS) store(corner + uvec2(i % TILE, i / TILE), NO_SEED, NO_SEED);
    return;
  }
  if (id == 0) atomicAdd(active_tiles, 1);
  for (uint i = id; i < TILE * TILE; i += THREADS) {
    uvec2 p = uvec2(i % TILE, i / TILE);
    uint center = p.x + push.radius;
    uint none = push.radius * push.radius + 1 << 16; // beyond the radius
    uint best = min(none, key(p.y, center, 0));
    for (int k = 1; k <= int(push.radius) && uint(k * k) <= best >> 16; k++) {
      best = min(best, min(key(p.y, center, -k), key(p.y, center, k)));
    }
    p += corner;
    bool reached = best < none;
    uint x = p.x + (best & 0xffu) - 64, y = p.y + (best >> 8 & 0xffu) - 64;
    store(p, reached ? x | y << 16 : NO_SEED, reached ? best >> 16 : NO_SEED);
  }
}
