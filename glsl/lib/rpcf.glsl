// Percentage-closer filtering of revectorized visibility, RPCF: [CG] Macedo, Apolinario, "Improved anti-aliasing for
// Euclidean distance transform shadow mapping", section 5; the mean of [JCGT] listing 5, or of another function, over
// w x w texel offsets. Include as lib/rbsm.glsl, with RPCF_WIDTH defined: odd, 1 to 31.
//
// The includer tests every texel of the kernel and of the ring around it, and keeps them as bits in rpcf_rows and
// rpcf_columns before it calls rpcfMean. The runs of listing 3 are found by bit scans; where a run leaves the kernel it is followed by tests, once for all texels of the run (the reuse
// of "Revectorization-Based Soft Shadow Mapping", algorithm 3, in both directions, for all shapes of edge).
#ifndef EDGESHADE_RPCF
#define EDGESHADE_RPCF
#include "lib/rbsm_profile.glsl"
#include "lib/rbsm_star.glsl"

const uint RPCF_ALL = (1u << RPCF_WIDTH) - 1u;

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

// What lies beyond each texel of a side of the kernel, in direction `dir`, with the sides across on which the texel differs.
// All runs that pass the texel share it, if they differ on the same sides. -1 and +1 need no step: the ring's test says.
struct Beyond {
  int distance; // signed, from the texel
  bvec2 across;
};

Beyond rpcf_beyond[4 * RPCF_WIDTH];

// `line` is the kernel's along that side, `ring` the tests next to it, outwards; `before` and `after` those at its ends;
// `next` is the way from texel to texel, opposite to the neighbour that across.x speaks of.
void followBeyond(ShadowPoint p, int first_index, TexelLine line, uint ring, uint before, uint after, ivec2 texel, ivec2 dir,
                  ivec2 next) {
  uint differs_before = line.tests ^ (line.tests << 1 | before);
  uint differs_after = line.tests ^ (line.tests >> 1 | after << (RPCF_WIDTH - 1));
  uint leaves = line.tests ^ ring;
  for (int i = 0; i < RPCF_WIDTH; ++i) rpcf_beyond[first_index + i] = Beyond(bitAt(leaves, i) ? 1 : -1, bvec2(false));
  // All lanes walk together: a walk within the sum would keep others waiting there.
  for (uint left = (differs_before | differs_after) & RPCF_ALL; left != 0u; left &= left - 1u) {
    int i = findLSB(left);
    bvec2 across = bvec2(bitAt(differs_before, i), bitAt(differs_after, i));
    float s = bitAt(line.tests, i) ? 1.0 : 0.0;
    rpcf_beyond[first_index + i] = Beyond(followShadowEdge(p, texel + i * next, dir, -next, s, across), across);
  }
}

// Whether what is kept of a border texel holds for a run through it that differs on the sides `across`.
bool isShared(Beyond kept, bvec2 across) { return !any(across) || kept.across == across; }

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
  ivec2 last = first + w - 1;
  if (function != 2) {
    // Left, right, +v, -v.
    uint top = rpcf_rows[0], bottom = rpcf_rows[w + 1], left = rpcf_columns[0], right = rpcf_columns[w + 1];
    const uint LAST = uint(w - 1);
    followBeyond(p, 0, kernelColumn(0), left, top & 1u, bottom & 1u, first, ivec2(-1, 0), ivec2(0, 1));
    followBeyond(p, w, kernelColumn(w - 1), right, top >> LAST & 1u, bottom >> LAST & 1u, ivec2(last.x, first.y), ivec2(1, 0),
                 ivec2(0, 1));
    followBeyond(p, 2 * w, kernelRow(w - 1), bottom, left >> LAST & 1u, right >> LAST & 1u, ivec2(first.x, last.y), ivec2(0, 1),
                 ivec2(1, 0));
    followBeyond(p, 3 * w, kernelRow(0), top, left & 1u, right & 1u, first, ivec2(0, -1), ivec2(1, 0));
  }
  float sum = 0.0;
  int uniform_lit = 0;
  // Texels left for the second loop: a bit a column, and a bit a row that has any.
  uint left_texels[w];
  uint left_rows = 0u;
  for (int j = 0; j < w; ++j) {
    TexelLine row = kernelRow(j);
    uint left = row.tests << 1 | (rpcf_columns[0] >> j & 1u);
    uint right = row.tests >> 1 | (rpcf_columns[w + 1] >> j & 1u) << (w - 1);
    uint edges = ((row.tests ^ row.before) | (row.tests ^ row.after) | (row.tests ^ left) | (row.tests ^ right)) & RPCF_ALL;
    uniform_lit += bitCount(row.tests & ~edges);
    left_texels[j] = 0u;
    if (function == 2) left_texels[j] = edges;
    else {
      Beyond row_start = rpcf_beyond[j], row_end = rpcf_beyond[w + j];
      for (; edges != 0u; edges &= edges - 1u) {
        int i = findLSB(edges);
        bool lit = bitAt(row.tests, i);
        float s = lit ? 1.0 : 0.0;
        // Left, right, +v, -v.
        vec4 N = vec4(left >> i & 1u, right >> i & 1u, row.after >> i & 1u, row.before >> i & 1u);
        // Sides across a row: -v, +v; across a column: left, right.
        bvec2 rows = notEqual(N.wz, vec2(s)), columns = notEqual(N.xy, vec2(s));
        ivec2 h = runInside(row, lit, rows, i), v = runInside(kernelColumn(i), lit, columns, j);
        Beyond column_end = rpcf_beyond[2 * w + i], column_start = rpcf_beyond[3 * w + i];
        if (h.x == 0 && !isShared(row_start, rows) || h.y == 0 && !isShared(row_end, rows) ||
            v.x == 0 && !isShared(column_start, columns) || v.y == 0 && !isShared(column_end, columns)) {
          left_texels[j] |= 1u << i;
          continue;
        }
        vec4 t = vec4(signedDistance(h.x, row_start.distance, i), signedDistance(h.y, row_end.distance, w - 1 - i),
                      signedDistance(v.y, column_end.distance, w - 1 - j), signedDistance(v.x, column_start.distance, j));
        vec3 d = packDiscontinuity(N, s);
        vec4 nrd = normalizeFragmentDistanceToSE(fragmentDistance(t, p.fraction));
        sum += function == 0 ? filterSilhouette(d, nrd) : computeRBSMStarVisibility(d, nrd);
      }
    }
    if (left_texels[j] != 0u) left_rows |= 1u << j;
  }
  // Few texels, each followed for itself; in a loop of its own, since a loop in the one above would cost all of its rounds.
  while (left_rows != 0u) {
    int j = findLSB(left_rows), i = findLSB(left_texels[j]);
    left_texels[j] &= left_texels[j] - 1u;
    if (left_texels[j] == 0u) left_rows &= left_rows - 1u;
    ShadowPoint q = p;
    q.texel = first + ivec2(i, j);
    float s = bitAt(rpcf_rows[j + 1], i) ? 1.0 : 0.0;
    vec3 d = computeDiscontinuity(q, s);
    if (function == 0) sum += revectorizeShadowEdge(q, d, false);
    else if (function == 1) sum += revectorizeStar(q, d);
    else sum += revectorizeProfile(q, d, RUN_ONLY);
  }
  return clamp((float(uniform_lit) + sum) / float(w * w), 0.0, 1.0);
}

#endif
