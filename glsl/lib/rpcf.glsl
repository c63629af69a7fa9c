// Percentage-closer filtering of revectorized visibility, RPCF: [CG] Macedo, Apolinario, "Improved anti-aliasing for
// Euclidean distance transform shadow mapping", section 5; the mean of [JCGT] listing 5, or of another function, over
// w x w texel offsets. Include as lib/rbsm.glsl, with RPCF_WIDTH defined: odd, 1 to 31.
//
// Every texel of the kernel and of the ring around it is tested once and kept as a bit. The runs of listing 3 are then
// found by bit scans; where a run leaves the kernel it is followed by tests, once for all texels of the run (the reuse
// of "Revectorization-Based Soft Shadow Mapping", algorithm 3, in both directions, for all shapes of edge).
#ifndef EDGESHADE_RPCF
#define EDGESHADE_RPCF
#include "lib/rbsm_profile.glsl"
#include "lib/rbsm_star.glsl"

const uint RPCF_ALL = RPCF_WIDTH == 31 ? 0x7fffffffu : (1u << RPCF_WIDTH) - 1u;

// Lit is 1. Rows from the ring's first to its last, without the ring's columns; bit i is the kernel's column i.
uint rpcf_rows[RPCF_WIDTH + 2];
// The kernel's columns, and the ring's two; bit j is the kernel's row j.
uint rpcf_columns[RPCF_WIDTH + 2];

bool bitAt(uint bits, int i) { return (bits >> i & 1u) != 0u; }

// A line of texels, a row or a column of the kernel, with its two neighbours and what lies at its ends.
struct TexelLine {
  uint tests;
  uint before, after; // the lines towards -u or -v, and towards +u or +v
};

TexelLine kernelRow(int j) { return TexelLine(rpcf_rows[j + 1], rpcf_rows[j], rpcf_rows[j + 2]); }
TexelLine kernelColumn(int i) { return TexelLine(rpcf_columns[i + 1], rpcf_columns[i], rpcf_columns[i + 2]); }

// Texels of a line that a run along it may go on to: those of test `s` that differ from their neighbour on a side on which
// the start differs.
uint runBits(TexelLine line, bool s, bvec2 across) {
  uint differs = (across.x ? line.tests ^ line.before : 0u) | (across.y ? line.tests ^ line.after : 0u);
  return (s ? line.tests : ~line.tests) & differs;
}

// Listing 3 along a line from texel i, as far as the kernel reaches; 0: the run leaves it.
ivec2 runInside(TexelLine line, bool s, bvec2 across, int i) {
  uint stops = ~runBits(line, s, across) & RPCF_ALL;
  uint low = stops & ((1u << i) - 1u), high = stops >> i >> 1;
  ivec2 n = ivec2(0);
  if (low != 0u) {
    int at = findMSB(low);
    n.x = bitAt(line.tests, at) != s ? i - at : at - i;
  }
  if (high != 0u) {
    int more = findLSB(high) + 1;
    n.y = bitAt(line.tests, i + more) != s ? more : -more;
  }
  return n;
}

// Listing 3 beyond a texel at the kernel's border. `side` is the way to the neighbour that across.x speaks of.
int runBeyond(ShadowPoint p, ivec2 texel, ivec2 dir, ivec2 side, float s, bvec2 across) {
  for (int i = 1; i <= MAXDIST; ++i) {
    texel += dir;
    if (shadowTest(p, texel) != s) return i;
    bool goes_on = across.x && shadowTest(p, texel + side) != s || across.y && shadowTest(p, texel - side) != s;
    if (!goes_on) return -i;
  }
  return -(MAXDIST + 1);
}

// The same, kept: all texels whose run passes a border texel share what lies beyond it, if they differ on the same sides.
int keptRunBeyond(ShadowPoint p, inout int kept, ivec2 texel, ivec2 dir, ivec2 side, float s, bvec2 across) {
  int key = 1 | (across.x ? 2 : 0) | (across.y ? 4 : 0);
  if ((kept & 7) != key) kept = (runBeyond(p, texel, dir, side, s, across) + 128) << 3 | key;
  return (kept >> 3) - 128;
}

// Signed distance of listing 3 from what was found: n inside; or, if that is 0, beyond `inside` more texels of the kernel.
float signedDistance(int n, int beyond, int inside) {
  if (n == 0) n = beyond < 0 ? beyond - inside : beyond + inside;
  return abs(n) > MAXDIST ? -float(MAXDIST + 1) : float(n);
}

// Mean visibility over the kernel around p.texel; rpcf_rows and rpcf_columns hold its tests.
// `function`: 0 listing 5, 1 RBSM*, 2 the edge profile of runs.
float rpcfMean(ShadowPoint p, int function) {
  const int w = RPCF_WIDTH;
  ivec2 first = p.texel - w / 2;
  int above[w], below[w];
  for (int i = 0; i < w; ++i) above[i] = below[i] = 0;
  float sum = 0.0;
  int uniform_lit = 0;
  for (int j = 0; j < w; ++j) {
    TexelLine row = kernelRow(j);
    uint left = row.tests << 1 | (rpcf_columns[0] >> j & 1u);
    uint right = row.tests >> 1 | (rpcf_columns[w + 1] >> j & 1u) << (w - 1);
    uint edges = ((row.tests ^ row.before) | (row.tests ^ row.after) | (row.tests ^ left) | (row.tests ^ right)) & RPCF_ALL;
    uniform_lit += bitCount(row.tests & ~edges);
    int before = 0, beyond = 0;
    for (; edges != 0u; edges &= edges - 1u) {
      int i = findLSB(edges);
      bool lit = bitAt(row.tests, i);
      float s = lit ? 1.0 : 0.0;
      // Left, right, +v, -v.
      vec4 N = vec4(left >> i & 1u, right >> i & 1u, row.after >> i & 1u, row.before >> i & 1u);
      vec3 d = packDiscontinuity(N, s);
      if (function == 2) {
        ShadowPoint q = p;
        q.texel = first + ivec2(i, j);
        sum += revectorizeProfile(q, d, RUN_ONLY);
        continue;
      }
      // Sides across a row: -v, +v; across a column: left, right.
      bvec2 rows = notEqual(N.wz, vec2(s)), columns = notEqual(N.xy, vec2(s));
      TexelLine column = kernelColumn(i);
      ivec2 h = runInside(row, lit, rows, i), v = runInside(column, lit, columns, j);
      ivec4 more = ivec4(0);
      if (h.x == 0) more.x = keptRunBeyond(p, before, first + ivec2(0, j), ivec2(-1, 0), ivec2(0, -1), s, rows);
      if (h.y == 0) more.y = keptRunBeyond(p, beyond, first + ivec2(w - 1, j), ivec2(1, 0), ivec2(0, -1), s, rows);
      if (v.y == 0) more.z = keptRunBeyond(p, below[i], first + ivec2(i, w - 1), ivec2(0, 1), ivec2(-1, 0), s, columns);
      if (v.x == 0) more.w = keptRunBeyond(p, above[i], first + ivec2(i, 0), ivec2(0, -1), ivec2(-1, 0), s, columns);
      vec4 t = vec4(signedDistance(h.x, more.x, i), signedDistance(h.y, more.y, w - 1 - i),
                    signedDistance(v.y, more.z, w - 1 - j), signedDistance(v.x, more.w, j));
      vec4 nrd = normalizeFragmentDistanceToSE(fragmentDistance(t, p.fraction));
      sum += function == 0 ? filterSilhouette(d, nrd) : computeRBSMStarVisibility(d, nrd);
    }
  }
  return clamp((float(uniform_lit) + sum) / float(w * w), 0.0, 1.0);
}

#endif
