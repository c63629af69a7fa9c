#version 460
// Finds the nearest seeds within a radius of at most HALO pixels on a CPU driver. A workgroup walks along eight rows, a
// tile of 32 pixels at a time, and stores the tiles in reach of a seed; the others are cleared already.
//
// Where one column is on the left of another, its seed is nearer to the pixels of a row up to some pixel, and the
// other's seed to the pixels from there on. So the nearest column never moves left from one pixel to the next. Every
// 16th pixel is compared with all columns in reach; the pixels between two of these are compared only with the columns
// between the nearest ones of the two.
//
// A column without a seed in reach counts as one whose seed is NONE rows below. Such a seed lies beyond the radius of
// every pixel, so it does not change any label.
//
// llvmpipe reaches an array whose indices are variables, if only those of a loop that it unrolls later, one thread at a
// time. Therefore loops over columns and pixels are written out.
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "edt.glsl"

// Eight rows of one block, in one subgroup.
layout(local_size_x = 8) in;

// 32 or 64.
layout(constant_id = 0) const uint HALO = 64;
layout(constant_id = 1) const bool SQUARED = false;

layout(binding = 0) uniform usampler2D columns; // edt_columns.comp
layout(binding = 1, scalar) readonly buffer Live { uint live[]; }; // edt_live.comp
// Rows are padded to whole quads.
layout(binding = 2, scalar) writeonly buffer Labels { uvec4 labels[]; };
layout(binding = 3, scalar) writeonly buffer SquaredDistances { uvec4 squared_distances[]; };
layout(binding = 4, scalar) buffer Active { uint active_tiles; };

// More than the rows to any seed of a column that has one in reach of its block.
const uint NONE = 96;
// Tiles on either side of a tile that its pixels reach.
const uint TILES = HALO / 32;
const uint RING = 64;

// Signed rows to the nearest seed of each column, plus NONE, in one byte: a ring of the words that were read last.
uint offsets[RING];
// Nearest column of every 16th pixel, from HALO pixels left of the tile that was read last to HALO pixels right of it:
// squared distance << 8 | signed columns to it, plus HALO.
uvec2 coarse0, coarse1, coarse2, coarse3, coarse4;

// Compares a column with two of the 16th pixels, the first of them at `first`; `key` is the square of its rows << 8.
void compareCoarse(inout uvec2 coarse, int first, int column, uint key) {
  ivec2 dx = column - first - ivec2(0, 16);
  uvec2 keys = key + uvec2((dx * dx << 8) + dx + int(HALO));
  coarse = mix(coarse, min(coarse, keys), lessThanEqual(abs(dx), ivec2(HALO)));
}

// Compares a column of the new tile with the 16th pixels. Returns its entry in `offsets`. `i` is the row in the block.
uint readColumn(int column, uint bits, uint above, uint below, uint i) {
  uint over = bits & 0xffffffffu >> (31 - i), under = bits >> i;
  uint up = over != 0 ? i - findMSB(over) : i + above;
  uint down = min(under != 0 ? findLSB(under) : 31 - i + below, NONE);
  uint rows = min(up, down), key = rows * rows << 8;
  int first = -int(HALO);
  compareCoarse(coarse0, first, column, key);
  compareCoarse(coarse1, first + 32, column, key);
  compareCoarse(coarse2, first + 64, column, key);
  compareCoarse(coarse3, first + 96, column, key);
  compareCoarse(coarse4, first + 128, column, key);
  return up <= down ? NONE - up : NONE + down;
}

// Reads the four columns that thread `w` has fetched.
uint readWord(uint w, uvec4 bits, uvec4 above, uvec4 below, uint i) {
  bits = subgroupShuffle(bits, w);
  above = subgroupShuffle(above, w);
  below = subgroupShuffle(below, w);
  int column = 4 * int(w);
  uint word = readColumn(column, bits.x, above.x, below.x, i);
  word |= readColumn(column + 1, bits.y, above.y, below.y, i) << 8;
  word |= readColumn(column + 2, bits.z, above.z, below.z, i) << 16;
  return word | readColumn(column + 3, bits.w, above.w, below.w, i) << 24;
}

// Reads the tile of columns from `x` on; its words begin at `ring`.
void readTile(uint x, uint ring, uint block, uint i) {
  coarse0 = coarse1;
  coarse1 = coarse2;
  coarse2 = coarse3;
  coarse3 = coarse4;
  coarse4 = uvec2(0xffffffffu);

  uvec4 mine = x + 4 * gl_LocalInvocationID.x + uvec4(0, 1, 2, 3), inside = min(mine, push.size.x - 1);
  uvec2 a = texelFetch(columns, ivec2(inside.x, block), 0).xy, b = texelFetch(columns, ivec2(inside.y, block), 0).xy;
  uvec2 c = texelFetch(columns, ivec2(inside.z, block), 0).xy, d = texelFetch(columns, ivec2(inside.w, block), 0).xy;
  bvec4 beyond = greaterThanEqual(mine, uvec4(push.size.x));
  uvec4 bits = mix(uvec4(a.x, b.x, c.x, d.x), uvec4(0), beyond);
  uvec4 next = mix(uvec4(a.y, b.y, c.y, d.y), uvec4(0xffffffffu), beyond);
  uvec4 above = next & FAR, below = next >> 16;
  offsets[ring] = readWord(0, bits, above, below, i);
  offsets[ring + 1] = readWord(1, bits, above, below, i);
  offsets[ring + 2] = readWord(2, bits, above, below, i);
  offsets[ring + 3] = readWord(3, bits, above, below, i);
  offsets[ring + 4] = readWord(4, bits, above, below, i);
  offsets[ring + 5] = readWord(5, bits, above, below, i);
  offsets[ring + 6] = readWord(6, bits, above, below, i);
  offsets[ring + 7] = readWord(7, bits, above, below, i);
}

// Compares a column with 16 pixels. A key holds the squared distance without the part that all columns of the pixel
// share, then the row and the column of the seed: for equal distances the smallest row wins, then the smallest column.
// `columns_key` is the key of the first pixel without rows; for each pixel further right, the key is smaller by `less`.
void compareSixteen(uint offset, int columns_key, int less, inout ivec4 a, inout ivec4 b, inout ivec4 c, inout ivec4 d) {
  int dy = int(offset) - int(NONE);
  int k0 = columns_key + (dy * dy << 16) + int(offset << 8), k1 = k0 - less, k2 = k1 - less, k3 = k2 - less;
  int k4 = k3 - less, k5 = k4 - less, k6 = k5 - less, k7 = k6 - less, k8 = k7 - less, k9 = k8 - less;
  int k10 = k9 - less, k11 = k10 - less, k12 = k11 - less, k13 = k12 - less, k14 = k13 - less, k15 = k14 - less;
  a = min(a, ivec4(k0, k1, k2, k3));
  b = min(b, ivec4(k4, k5, k6, k7));
  c = min(c, ivec4(k8, k9, k10, k11));
  d = min(d, ivec4(k12, k13, k14, k15));
}

// Stores four pixels from `p` on; `shared_part` completes the squared distances of their keys, and the columns of the
// keys count from pixel `origin`.
void storeQuad(uvec2 p, uint origin, ivec4 keys, ivec4 shared_part) {
  uvec4 squared = uvec4((keys >> 16) + shared_part);
  uvec4 x = origin + uvec4(keys & 0xff) - 128, y = p.y + uvec4(keys >> 8 & 0xff) - NONE;
  bvec4 reached = lessThanEqual(squared, uvec4(push.radius * push.radius));
  uint quads = (push.size.x + 3) / 4;
  if (p.x / 4 >= quads || p.y >= push.size.y) return;
  uint i = p.x / 4 + quads * p.y;
  labels[i] = mix(uvec4(NO_SEED), x | y << 16, reached);
  if (SQUARED) squared_distances[i] = mix(uvec4(NO_SEED), squared, reached);
}

// Stores 16 pixels from `p` on, which lie `x` columns right of the first pixel of the tile; `from` and `to` are the
// coarse entries of `p` and of the pixel after the 16. The columns from HALO left of the tile on begin at `ring`.
void storeSixteen(uvec2 p, uint x, uint ring, uint from, uint to) {
  uint first = x + (from & 0xffu), last = x + 16 + (to & 0xffu);
  ivec4 a = ivec4(0x7fffffff), b = a, c = a, d = a;
  for (uint w = first / 4; w <= last / 4; w++) {
    uint word = offsets[(ring + w) % RING];
    // Pixel i is dx - i columns away, and (dx - i)^2 = dx^2 - 2 i dx + i^2, of which i^2 is the shared part.
    int dx = 4 * int(w) - int(HALO + x);
    int less = dx << 17, key = (dx * dx << 16) + dx + 128;
    compareSixteen(word & 0xffu, key, less, a, b, c, d);
    key += less + (1 << 16) + 1; // (dx + 1)^2 = dx^2 + 2 dx + 1
    less += 1 << 17;
    compareSixteen(word >> 8 & 0xffu, key, less, a, b, c, d);
    key += less + (1 << 16) + 1;
    less += 1 << 17;
    compareSixteen(word >> 16 & 0xffu, key, less, a, b, c, d);
    key += less + (1 << 16) + 1;
    less += 1 << 17;
    compareSixteen(word >> 24, key, less, a, b, c, d);
  }
  storeQuad(p, p.x, a, ivec4(0, 1, 4, 9));
  storeQuad(p + uvec2(4, 0), p.x, b, ivec4(16, 25, 36, 49));
  storeQuad(p + uvec2(8, 0), p.x, c, ivec4(64, 81, 100, 121));
  storeQuad(p + uvec2(12, 0), p.x, d, ivec4(144, 169, 196, 225));
}

void main() {
  // All threads stay to the end, because they read for each other.
  uint y = gl_GlobalInvocationID.x, block = y / 32, tiles = (push.size.x + 31) / 32;
  // Tiles of the segment that the workgroup stores. It reads TILES more on either side.
  uint begin = gl_WorkGroupID.y * push.span, end = min(begin + push.span, tiles);
  for (uint w = 0; w < RING; w++) offsets[w] = 2 * NONE * 0x01010101u;
  coarse0 = coarse1 = coarse2 = coarse3 = coarse4 = uvec2(0xffffffffu);
  uint tile = begin - min(begin, TILES), ring = 0, count = 0;
  // The first tile that no seed found so far makes worth reading.
  uint reach = 0;
  for (;;) {
    // After a tile with seeds, read all tiles in their reach. Then go on to the next tile with seeds: between them all
    // columns are as those that were read last.
    for (; tile < end + TILES; tile++) {
      if (tile < tiles && live[tile + tiles * block] != 0) reach = tile + 2 * TILES + 1;
      if (tile < reach) break;
    }
    if (tile >= end + TILES) break;
    readTile(32 * tile, ring, block, y % 32);
    tile++;
    ring = (ring + 8) % RING;
    if (tile <= begin + TILES) continue;
    count++;
    uvec2 p = uvec2(32 * (tile - 1 - TILES), y);
    uint left = ring + RING - 8 - HALO / 2;
    storeSixteen(p, 0, left, coarse0.x, coarse0.y);
    storeSixteen(p + uvec2(16, 0), 16, left, coarse0.y, coarse1.x);
  }
  if (gl_LocalInvocationID.x == 0) atomicAdd(active_tiles, count);
}
