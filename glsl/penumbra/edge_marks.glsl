// Marks the tiles that a penumbra may reach, for marked_tiles.comp.
// Include after edge_seeds.glsl.
#ifndef EDGESHADE_EDGE_MARKS
#define EDGESHADE_EDGE_MARKS

layout(binding = 7, scalar) buffer Marks { uint marks[]; }; // one bit per tile, 8 x 8 tiles in two words

const int MARKS = 8;

void mark(ivec2 first, ivec2 last) {
  ivec2 blocks = (tileCount() + MARKS - 1) / MARKS;
  for (int y = first.y / MARKS; y <= last.y / MARKS; ++y) {
    // Rows of this block of marks that are in reach, then the columns of one row.
    ivec2 rows = clamp(ivec2(first.y, last.y) - MARKS * y, 0, MARKS - 1);
    for (int x = first.x / MARKS; x <= last.x / MARKS; ++x) {
      ivec2 columns = clamp(ivec2(first.x, last.x) - MARKS * x, 0, MARKS - 1);
      uint row = (2u << columns.y) - (1u << columns.x);
      uint bits[2] = {0, 0};
      for (int r = rows.x; r <= rows.y; ++r) bits[r >> 2] |= row << 8 * (r & 3);
      // Neighbouring seeds mark the same tiles: skip the atomic where all bits are set.
      for (int i = 0; i < 2; ++i) {
        int word = 2 * (y * blocks.x + x) + i;
        if ((bits[i] & ~marks[word]) != 0) atomicOr(marks[word], bits[i]);
      }
    }
  }
}

#endif
