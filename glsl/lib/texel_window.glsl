// Shadow tests of a window of texels as bits, and the runs of [JCGT] listing 3 within the window by bit scans. A run
// that leaves the window is followed by tests, once for all texels that share it. This is the reuse of
// "Revectorization-Based Soft Shadow Mapping", algorithm 3, in both directions and for all shapes of edge. Include like
// lib/rbsm.glsl, with WINDOW_MOST defined as the largest number of texels along a side, 1 to 31.
//
// The shader calls testWindow and then followBeyond. Instead of testWindow it may test every texel of the window and of the
// ring around it itself: it calls clearWindow, then setWindowRow for each row.
#ifndef EDGESHADE_TEXEL_WINDOW
#define EDGESHADE_TEXEL_WINDOW
#extension GL_EXT_control_flow_attributes : require
#include "lib/rbsm.glsl"

// Every array in this file is indexed by constants alone: the loops over it are unrolled, and such a loop selects the
// element of a computed index. A GPU then keeps the arrays in registers. It would move an array with a computed index to
// memory, or branch over its elements. All other loops ask not to be unrolled, which would multiply the code.

// Tests of the window's rows and columns; bit i of row j and bit j of column i are texel (i, j); 1 is lit. If the window
// has fewer than WINDOW_MOST rows, the ring's last row follows them, and so it is with the columns.
// Where they fit, the columns share the words of the rows, in the upper halves.
const bool PACKED = WINDOW_MOST <= 16;
uint window_rows[WINDOW_MOST], window_columns[PACKED ? 1 : WINDOW_MOST];
// Tests of the ring along each side, without its corners, in the order of SIDES: left, right, +v, -v.
uint window_ring[4];

bool bitAt(uint bits, int i) { return (bits >> i & 1u) != 0u; }

// Mask of a line of n texels.
uint lineBits(int n) { return (1u << n) - 1u; }

void clearWindow() {
  [[unroll]] for (int k = 0; k < WINDOW_MOST; ++k) window_rows[k] = 0u;
  [[unroll]] for (int k = 0; k < 4; ++k) window_ring[k] = 0u;
}

// Stores the tests of row j of a window of `size` texels: those within the window as bits, and the ring's two at its
// ends. The ring's rows are -1 and size.y; later rows are ignored.
void setWindowRow(int j, ivec2 size, uint tests, bool left, bool right) {
  if (j > size.y) return;
  uint bit = j >= 0 && j < size.y ? 1u << j : 0u;
  window_ring[0] |= left ? bit : 0u;
  window_ring[1] |= right ? bit : 0u;
  window_ring[2] = j == size.y ? tests : window_ring[2];
  window_ring[3] = j == -1 ? tests : window_ring[3];
  [[unroll]] for (int k = 0; k < WINDOW_MOST; ++k) window_rows[k] = k == j ? tests : window_rows[k];
}

// Tests a window of at most 30 x 30 texels that starts at `first`, and the ring around it, and stores the tests.
void testWindow(ShadowPoint p, ivec2 first, ivec2 size) {
  clearWindow();
  [[dont_unroll]] for (int j = 0; j < size.y + 2; j += 2) {
    // Bit i is the ring's column i.
    uint upper = 0u, lower = 0u;
    [[dont_unroll]] for (int i = 0; i < size.x + 2; i += 2) {
      uint tests = shadowTest2x2(p, first - 1 + ivec2(i, j));
      upper |= (tests & 3u) << i;
      lower |= tests >> 2 << i;
    }
    setWindowRow(j - 1, size, upper >> 1 & lineBits(size.x), bitAt(upper, 0), bitAt(upper, size.x + 1));
    setWindowRow(j, size, lower >> 1 & lineBits(size.x), bitAt(lower, 0), bitAt(lower, size.x + 1));
  }
}

// Side of a square of bits that holds the window.
const int SQUARE = WINDOW_MOST <= 8 ? 8 : WINDOW_MOST <= 16 ? 16 : 32;

// Makes the columns of a window of `size` texels from its rows.
void setWindowColumns(ivec2 size) {
  uint lines[SQUARE];
  [[unroll]] for (int k = 0; k < SQUARE; ++k) lines[k] = k < WINDOW_MOST ? window_rows[min(k, WINDOW_MOST - 1)] : 0u;
  // Transposes the square: swaps its two blocks off the diagonal, then does the same within each of its four blocks.
  [[unroll]] for (int halvings = 0; halvings < 5; ++halvings) {
    int block = 16 >> halvings;
    uint every_other = ~0u / ((1u << block) + 1u); // bits of every other block
    if (block < SQUARE) {
      [[unroll]] for (int k = 0; k < SQUARE; ++k) {
        if ((k & block) == 0) {
          uint differ = (lines[k] >> block ^ lines[k | block]) & every_other;
          lines[k] ^= differ << block;
          lines[k | block] ^= differ;
        }
      }
    }
  }
  [[unroll]] for (int k = 0; k < WINDOW_MOST; ++k) {
    uint column = k == size.x ? window_ring[1] : lines[k] & lineBits(size.y);
    if (PACKED) window_rows[k] |= column << 16;
    else window_columns[k] = column;
  }
}

// A row or column of the window, with its two neighbours.
struct TexelLine {
  uint tests;
  uint before, after; // lines towards -u or -v, and towards +u or +v
};

TexelLine windowRow(int j) {
  TexelLine line = TexelLine(0u, 0u, 0u);
  [[unroll]] for (int k = 0; k < WINDOW_MOST; ++k) {
    uint before = k > 0 ? window_rows[max(k - 1, 0)] : window_ring[3];
    uint after = k + 1 < WINDOW_MOST ? window_rows[min(k + 1, WINDOW_MOST - 1)] : window_ring[2];
    if (k == j) line = TexelLine(window_rows[k], before, after);
  }
  if (PACKED) line = TexelLine(line.tests & 0xffffu, line.before & 0xffffu, line.after & 0xffffu);
  return line;
}

uint columnWord(int k) { return PACKED ? window_rows[k] >> 16 : window_columns[PACKED ? 0 : k]; }

TexelLine windowColumn(int i) {
  TexelLine line = TexelLine(0u, 0u, 0u);
  [[unroll]] for (int k = 0; k < WINDOW_MOST; ++k) {
    uint before = k > 0 ? columnWord(max(k - 1, 0)) : window_ring[0];
    uint after = k + 1 < WINDOW_MOST ? columnWord(min(k + 1, WINDOW_MOST - 1)) : window_ring[1];
    if (k == i) line = TexelLine(columnWord(k), before, after);
  }
  return line;
}

// Texels of a line to which a run along it can extend: they have the test `s`, and differ from their neighbour on a
// side on which the start differs.
uint runBits(TexelLine line, bool s, bvec2 across) {
  uint differs = (across.x ? line.tests ^ line.before : 0u) | (across.y ? line.tests ^ line.after : 0u);
  return (s ? line.tests : ~line.tests) & differs;
}

// Listing 3 along a line of n texels from texel i, as far as the window reaches; 0 if the run leaves the window.
ivec2 runInside(TexelLine line, int n, bool s, bvec2 across, int i) {
  uint stops = ~runBits(line, s, across) & lineBits(n);
  uint low = stops & ((1u << i) - 1u), high = stops >> i >> 1;
  ivec2 found = ivec2(0);
  if (low != 0u) {
    int at = findMSB(low);
    found.x = bitAt(line.tests, at) != s ? i - at : at - i;
  }
  if (high != 0u) {
    int more = findLSB(high) + 1;
    found.y = bitAt(line.tests, i + more) != s ? more : -more;
  }
  return found;
}

// Signed distances from the border texels to the ends of runs beyond them, a byte each, by side: left, right, +v, -v.
// If a texel differs on no side across the run, the ring's test tells the distance, +1 or -1, and the byte is unused.
const int BEYOND_WORDS = (WINDOW_MOST + 3) / 4;
uint window_beyond[4 * BEYOND_WORDS];

// Follows the runs beyond the border of a window of `size` texels that starts at `first`.
void followBeyond(ShadowPoint p, ivec2 first, ivec2 size) {
  setWindowColumns(size);
  [[unroll]] for (int k = 0; k < 4 * BEYOND_WORDS; ++k) window_beyond[k] = 0u;
  // A loop keeps a single copy of the traversal's code.
  [[dont_unroll]] for (int side = 0; side < 4; ++side) {
    // The border texels along the side: one line of n texels, and the step from texel to texel.
    bool is_column = side < 2;
    int n = is_column ? size.y : size.x;
    ivec2 start = side == 1 ? ivec2(size.x - 1, 0) : side == 2 ? ivec2(0, size.y - 1) : ivec2(0);
    ivec2 next = is_column ? ivec2(0, 1) : ivec2(1, 0);
    uint tests = is_column ? windowColumn(start.x).tests : windowRow(start.y).tests;
    uint ring_before = is_column ? window_ring[3] >> start.x : window_ring[0] >> start.y;
    uint ring_after = is_column ? window_ring[2] >> start.x : window_ring[1] >> start.y;
    uint differs_before = tests ^ (tests << 1 | ring_before & 1u);
    uint differs_after = tests ^ (tests >> 1 | (ring_after & 1u) << (n - 1));
    // All threads walk here together. A walk inside the sum would make the others wait there.
    [[dont_unroll]] for (uint left = (differs_before | differs_after) & lineBits(n); left != 0u; left &= left - 1u) {
      int i = findLSB(left);
      bvec2 across = bvec2(bitAt(differs_before, i), bitAt(differs_after, i));
      int distance = followShadowEdge(p, first + start + i * next, SIDES[side], -next, bitAt(tests, i) ? 1.0 : 0.0, across);
      int word = side * BEYOND_WORDS + i / 4;
      uint bits = (uint(distance) & 255u) << 8 * (i & 3);
      [[unroll]] for (int k = 0; k < 4 * BEYOND_WORDS; ++k) window_beyond[k] |= k == word ? bits : 0u;
    }
  }
}

// Continuation of a run beyond a border texel of the window: its length, and the sides across on which the border texel
// differs. All runs through the texel share it if they differ on the same sides.
struct Beyond {
  int distance; // signed, from the texel
  bvec2 across;
};

// Continuation beyond one side, a constant, along the line of number i. Its border texel is bit `at` of the line.
Beyond beyondLine(int side, TexelLine line, int i, int at) {
  uint bytes = 0u;
  [[unroll]] for (int k = 0; k < BEYOND_WORDS; ++k) bytes = k == i / 4 ? window_beyond[side * BEYOND_WORDS + k] : bytes;
  Beyond b;
  b.across = bvec2(bitAt(line.tests ^ line.before, at), bitAt(line.tests ^ line.after, at));
  b.distance = bitfieldExtract(int(bytes), 8 * (i & 3), 8);
  if (!any(b.across)) b.distance = bitAt(line.tests, at) != bitAt(window_ring[side], i) ? 1 : -1;
  return b;
}

// Tests whether the stored continuation of a border texel is valid for a run that differs on the sides `across`.
bool isShared(Beyond kept, bvec2 across) { return !any(across) || kept.across == across; }

// Signed distance of listing 3 from the parts of a run: n within the window; or, if n is 0, `beyond` after `inside`
// more texels of the window.
float signedDistance(int n, int beyond, int inside) {
  if (n == 0) n = beyond < 0 ? beyond - inside : beyond + inside;
  return abs(n) > MAXDIST ? -float(MAXDIST + 1) : float(n);
}

// Texels of row j that differ from a neighbour, in a window of `size` texels; also the tests of their neighbours along
// the row.
uint edgeBits(TexelLine row, int j, ivec2 size, out uint left, out uint right) {
  left = row.tests << 1 | (window_ring[0] >> j & 1u);
  right = row.tests >> 1 | (window_ring[1] >> j & 1u) << (size.x - 1);
  return ((row.tests ^ row.before) | (row.tests ^ row.after) | (row.tests ^ left) | (row.tests ^ right)) & lineBits(size.x);
}

uint edgeBits(TexelLine row, int j, ivec2 size) {
  uint left, right;
  return edgeBits(row, j, size, left, right);
}

// Discontinuity and signed distances of listing 3, in the order of SIDES, of a texel at an edge; `row` is its row.
// Returns a bit for each side on which the run leaves the window and the stored continuation belongs to another run;
// followOwn finds these distances.
uint traverseInWindow(TexelLine row, ivec2 texel, ivec2 size, out vec3 d, out vec4 t) {
  TexelLine column = windowColumn(texel.x);
  bool lit = bitAt(row.tests, texel.x);
  float s = lit ? 1.0 : 0.0;
  uint left, right;
  edgeBits(row, texel.y, size, left, right);
  // Left, right, +v, -v.
  vec4 N = vec4(left >> texel.x & 1u, right >> texel.x & 1u, row.after >> texel.x & 1u, row.before >> texel.x & 1u);
  d = packDiscontinuity(N, s);
  // Sides across a row: -v, +v; across a column: left, right.
  bvec2 rows = notEqual(N.wz, vec2(s)), columns = notEqual(N.xy, vec2(s));
  ivec2 h = runInside(row, size.x, lit, rows, texel.x), v = runInside(column, size.y, lit, columns, texel.y);
  ivec2 last = size - 1, after = last - texel;
  Beyond row_start = beyondLine(0, row, texel.y, 0), row_end = beyondLine(1, row, texel.y, last.x);
  Beyond column_end = beyondLine(2, column, texel.x, last.y), column_start = beyondLine(3, column, texel.x, 0);
  t = vec4(signedDistance(h.x, row_start.distance, texel.x), signedDistance(h.y, row_end.distance, after.x),
           signedDistance(v.y, column_end.distance, after.y), signedDistance(v.x, column_start.distance, texel.y));
  bvec4 own = bvec4(h.x == 0 && !isShared(row_start, rows), h.y == 0 && !isShared(row_end, rows),
                    v.y == 0 && !isShared(column_end, columns), v.x == 0 && !isShared(column_start, columns));
  return uint(own.x) | uint(own.y) << 1 | uint(own.z) << 2 | uint(own.w) << 3;
}

// Follows the runs of a texel beyond the sides whose bits are set, for this texel alone, and stores their signed
// distances in `t`. The window of `size` texels starts at `first`.
void followOwn(ShadowPoint p, ivec2 first, ivec2 size, ivec2 texel, vec3 d, uint sides, inout vec4 t) {
  ivec2 last = size - 1;
  ivec4 inside = ivec4(texel.x, last.x - texel.x, last.y - texel.y, texel.y);
  bvec4 differs = discontinuitySides(d);
  [[dont_unroll]] for (; sides != 0u; sides &= sides - 1u) {
    int k = findLSB(sides);
    ivec2 border = texel + inside[k] * SIDES[k], across = k < 2 ? ivec2(0, 1) : ivec2(-1, 0);
    int distance = followShadowEdge(p, first + border, SIDES[k], across, 1.0 - d.z, k < 2 ? differs.zw : differs.xy);
    t[k] = signedDistance(0, distance, inside[k]);
  }
}

#endif
