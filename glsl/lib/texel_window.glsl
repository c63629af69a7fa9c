// Shadow tests of a window of texels as bits, and the runs of [JCGT] listing 3 within the window by bit scans. A run
// that leaves the window is followed by tests, once for all texels that share it. This is the reuse of
// "Revectorization-Based Soft Shadow Mapping", algorithm 3, in both directions and for all shapes of edge. Include like
// lib/rbsm.glsl, with WINDOW_MOST defined as the largest number of texels along a side, 1 to 31.
//
// The shader tests every texel of the window and of the ring around it, and stores the tests in window_rows and
// window_columns.
#ifndef EDGESHADE_TEXEL_WINDOW
#define EDGESHADE_TEXEL_WINDOW
#include "lib/rbsm.glsl"

// Rows of tests, from the ring's first to its last, without the ring's columns. Bit i is the window's column i; 1 is
// lit.
uint window_rows[WINDOW_MOST + 2];
// Columns of tests, from the ring's first to its last, without the ring's rows. Bit j is the window's row j.
uint window_columns[WINDOW_MOST + 2];

bool bitAt(uint bits, int i) { return (bits >> i & 1u) != 0u; }

// Mask of a line of n texels.
uint lineBits(int n) { return (1u << n) - 1u; }

// A row or column of the window, with its two neighbours.
struct TexelLine {
  uint tests;
  uint before, after; // lines towards -u or -v, and towards +u or +v
};

TexelLine windowRow(int j) { return TexelLine(window_rows[j + 1], window_rows[j], window_rows[j + 2]); }
TexelLine windowColumn(int i) { return TexelLine(window_columns[i + 1], window_columns[i], window_columns[i + 2]); }

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

// Continuation of a run beyond a border texel of the window: its length, and the sides across on which the border texel
// differs. All runs through the texel share it if they differ on the same sides. Lengths of -1 and +1 need no walk: the
// ring's test gives them.
struct Beyond {
  int distance; // signed, from the texel
  bvec2 across;
};

// One entry per border texel, by side: left, right, +v, -v.
Beyond window_beyond[4 * WINDOW_MOST];

// Follows the runs beyond one side. `line` holds the n texels of the window along that side, `ring` the tests next to
// it on the outside, and `before` and `after` the tests at its ends. `next` is the step from texel to texel along the
// side, opposite to the neighbour that across.x refers to.
void followBeyond(ShadowPoint p, int side, TexelLine line, int n, uint ring, uint before, uint after, ivec2 texel, ivec2 next) {
  uint differs_before = line.tests ^ (line.tests << 1 | before);
  uint differs_after = line.tests ^ (line.tests >> 1 | after << (n - 1));
  uint leaves = line.tests ^ ring;
  for (int i = 0; i < n; ++i) window_beyond[side * WINDOW_MOST + i] = Beyond(bitAt(leaves, i) ? 1 : -1, bvec2(false));
  // All threads walk here together. A walk inside the sum would make the others wait there.
  for (uint left = (differs_before | differs_after) & lineBits(n); left != 0u; left &= left - 1u) {
    int i = findLSB(left);
    bvec2 across = bvec2(bitAt(differs_before, i), bitAt(differs_after, i));
    float s = bitAt(line.tests, i) ? 1.0 : 0.0;
    int distance = followShadowEdge(p, texel + i * next, SIDES[side], -next, s, across);
    window_beyond[side * WINDOW_MOST + i] = Beyond(distance, across);
  }
}

// Follows the runs beyond all four sides of a window of `size` texels that starts at `first`.
void followBeyond(ShadowPoint p, ivec2 first, ivec2 size) {
  ivec2 last = size - 1;
  uint left = window_columns[0], right = window_columns[size.x + 1], top = window_rows[0], bottom = window_rows[size.y + 1];
  followBeyond(p, 0, windowColumn(0), size.y, left, top & 1u, bottom & 1u, first, ivec2(0, 1));
  followBeyond(p, 1, windowColumn(last.x), size.y, right, top >> last.x & 1u, bottom >> last.x & 1u,
               first + ivec2(last.x, 0), ivec2(0, 1));
  followBeyond(p, 2, windowRow(last.y), size.x, bottom, left >> last.y & 1u, right >> last.y & 1u, first + ivec2(0, last.y),
               ivec2(1, 0));
  followBeyond(p, 3, windowRow(0), size.x, top, left & 1u, right & 1u, first, ivec2(1, 0));
}

// Tests whether the stored continuation of a border texel is valid for a run that differs on the sides `across`.
bool isShared(Beyond kept, bvec2 across) { return !any(across) || kept.across == across; }

// Signed distance of listing 3 from the parts of a run: n within the window; or, if n is 0, `beyond` after `inside`
// more texels of the window.
float signedDistance(int n, int beyond, int inside) {
  if (n == 0) n = beyond < 0 ? beyond - inside : beyond + inside;
  return abs(n) > MAXDIST ? -float(MAXDIST + 1) : float(n);
}

// Texels of row j that differ from a neighbour, in a window of `size` texels.
uint edgeBits(int j, ivec2 size, out uint left, out uint right) {
  TexelLine row = windowRow(j);
  left = row.tests << 1 | (window_columns[0] >> j & 1u);
  right = row.tests >> 1 | (window_columns[size.x + 1] >> j & 1u) << (size.x - 1);
  return ((row.tests ^ row.before) | (row.tests ^ row.after) | (row.tests ^ left) | (row.tests ^ right)) & lineBits(size.x);
}

// Discontinuity and signed distances of listing 3, in the order of SIDES, of a texel at an edge. Returns false if one
// of its runs leaves the window and the stored continuation belongs to another run; such a texel must be followed for
// itself.
bool traverseInWindow(ivec2 texel, ivec2 size, out vec3 d, out vec4 t) {
  TexelLine row = windowRow(texel.y), column = windowColumn(texel.x);
  bool lit = bitAt(row.tests, texel.x);
  float s = lit ? 1.0 : 0.0;
  uint left, right;
  edgeBits(texel.y, size, left, right);
  // Left, right, +v, -v.
  vec4 N = vec4(left >> texel.x & 1u, right >> texel.x & 1u, row.after >> texel.x & 1u, row.before >> texel.x & 1u);
  d = packDiscontinuity(N, s);
  // Sides across a row: -v, +v; across a column: left, right.
  bvec2 rows = notEqual(N.wz, vec2(s)), columns = notEqual(N.xy, vec2(s));
  ivec2 h = runInside(row, size.x, lit, rows, texel.x), v = runInside(column, size.y, lit, columns, texel.y);
  Beyond row_start = window_beyond[texel.y], row_end = window_beyond[WINDOW_MOST + texel.y];
  Beyond column_end = window_beyond[2 * WINDOW_MOST + texel.x], column_start = window_beyond[3 * WINDOW_MOST + texel.x];
  ivec2 after = size - 1 - texel;
  t = vec4(signedDistance(h.x, row_start.distance, texel.x), signedDistance(h.y, row_end.distance, after.x),
           signedDistance(v.y, column_end.distance, after.y), signedDistance(v.x, column_start.distance, texel.y));
  return !(h.x == 0 && !isShared(row_start, rows) || h.y == 0 && !isShared(row_end, rows) ||
           v.x == 0 && !isShared(column_start, columns) || v.y == 0 && !isShared(column_end, columns));
}

#endif
