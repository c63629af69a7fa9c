// Pairs of a caster (a triangle or an edge) and a block of cells that it may matter to, on three levels. Threads that
// find a pair append it; a later pass refines it. The order of pairs is arbitrary, but nothing depends on it.
// Include after grid.glsl.
#ifndef EDGESHADE_CASTER_LISTS
#define EDGESHADE_CASTER_LISTS

layout(binding = 0, scalar) buffer Depths { uint depths[]; };
layout(binding = 1, scalar) buffer Header { ListHeader header; };
layout(binding = 2, scalar) buffer Pairs { uvec2 pairs[]; };

const uint MAX_GROUPS = 65535;

// A pair: the caster, and the block with a bit for each of the 16 blocks or cells inside that the caster may matter to.
uvec2 packPair(uint caster, uvec2 block, uint children) { return uvec2(caster, block.x | block.y << 8 | children << 16); }
uvec2 blockOf(uvec2 pair) { return uvec2(pair.y & 0xFFu, pair.y >> 8 & 0xFFu); }

// Appends a pair on a level from 1 to 3. The pairs of a level lie one after the other.
void appendPair(int level, uvec2 pair) {
  uint i = level == 3 ? atomicAdd(header.count3, 1) : level == 2 ? atomicAdd(header.count2, 1) : atomicAdd(header.count1, 1);
  if (i >= push.pairs) {
    uint block = coarseBlock(blockOf(pair) << (2 * level));
    atomicOr(header.lost_blocks[block >> 5], 1u << (block & 31u));
    atomicAdd(header.lost, 1);
    return;
  }
  pairs[uint(level - 1) * push.pairs + i] = pair;
  if ((i & 63u) != 0) return;
  uint groups = min(i / 64 + 1, MAX_GROUPS);
  if (level == 3) atomicMax(header.groups3[0], groups);
  else if (level == 2) atomicMax(header.groups2[0], groups);
  else atomicMax(header.groups1[0], groups);
}

// Marks all cells as cells whose casters found no room.
void loseAll(uint casters) {
  atomicAdd(header.lost, casters);
  for (int i = 0; i < 8; ++i) atomicOr(header.lost_blocks[i], 0xFFFFFFFFu);
}

// Bits from `low` to `high`, which may lie outside 0 to 3.
uint bitsBetween(int low, int high) { return (15u << clamp(low, 0, 4)) & (15u >> clamp(3 - high, 0, 4)) & 15u; }

// Appends a caster for the blocks between two corners (cells, inclusive), on the finest level on which they are few.
// Blocks whose receivers all lie nearer to the light than `nearest` are left out.
void appendBlocks(uint caster, ivec2 low, ivec2 high, float nearest) {
  low = max(low, ivec2(0));
  high = min(high, ivec2(push.cells) - 1);
  if (any(greaterThan(low, high))) return;
  int level = 1;
  while (level < 3 && any(greaterThan((high >> (2 * level)) - (low >> (2 * level)), ivec2(3)))) ++level;
  uint wanted = orderedBits(nearest);
  ivec2 first = low >> (2 * level - 2), last = high >> (2 * level - 2);
  for (int y = first.y >> 2; y <= last.y >> 2; ++y) {
    for (int x = first.x >> 2; x <= last.x >> 2; ++x) {
      uint deepest = depths[levelStart(level) + uint(y) * levelSide(level) + uint(x)];
      if (deepest == 0 || deepest < wanted) continue;
      uint columns = bitsBetween(first.x - 4 * x, last.x - 4 * x), rows = bitsBetween(first.y - 4 * y, last.y - 4 * y);
      uint children = 0;
      for (int i = 0; i < 4; ++i) {
        if ((rows >> i & 1u) != 0) children |= columns << (4 * i);
      }
      appendPair(level, packPair(caster, uvec2(x, y), children));
    }
  }
}

#endif
