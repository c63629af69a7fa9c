// Mean of revectorized visibility over a window of any width: [CGF] Macedo, Apolinario, Aguero, "Revectorization-based
// soft shadow mapping" (2019), algorithm 3.
// Include after common/soft_receiver.glsl, common/rbsm_receiver.glsl, lib/rbsm_star.glsl and lib/texel_window.glsl.
//
// A tap of the filter is a point in the map, not a texel. The n x n taps lie at the centres of a regular grid over the
// window; each is lit or in shadow according to the edge that runs through its texel. So a window narrower than a texel
// sees the straightened edge, and a window without width gives the hard technique. Taps several texels apart find the
// edge in their own texels and miss the texels in between.
//
// Departures: runs are followed per texel, not per tap. The paper's reuse along a kernel row is corrected (sameRun);
// filterAsPrinted is the printed one.
#ifndef EDGESHADE_REVECTORIZED_FILTER
#define EDGESHADE_REVECTORIZED_FILTER

layout(constant_id = 3) const int FILTER_TAPS = 11; // along each axis
layout(constant_id = 5) const bool STAR = true;     // RBSM*; false: listing 4
// Ends of runs: followed for each tap, found once for all taps on the run, or moved along a row as algorithm 3 prints it.
// The first two give the same image.
const int EACH_TAP = 0, EACH_RUN = 1, AS_PRINTED = 2;
layout(constant_id = 8) const int REUSE = EACH_RUN;

// Place of tap (i, j) in the map, texels.
vec2 tapPlace(SoftReceiver r, vec2 half_texels, ivec2 tap) {
  precise vec2 place = r.at + ((2.0 * vec2(tap) + 1.0) / float(FILTER_TAPS) - 1.0) * half_texels;
  return place;
}

vec2 fractionOf(vec2 place) { return clamp(place - floor(place), vec2(1e-7), vec2(1.0 - 6e-8)); }

// Visibility at a place in a texel at an edge, from its discontinuity and the ends of its runs.
float edgeVisibility(vec3 d, vec4 rd) {
  vec4 nrd = normalizeFragmentDistanceToSE(rd);
  return STAR ? computeRBSMStarVisibility(d, nrd) : computeRBSMVisibility(d, nrd, true);
}

float edgeVisibility(vec3 d, vec4 t, vec2 fraction) { return edgeVisibility(d, fragmentDistance(t, fraction)); }

// Tests whether a texel's edge must be followed. Listing 4 changes no shadowed texel.
bool hasEdge(float s, vec3 d) { return (STAR || s == 1.0) && (d.x > 0.0 || d.y > 0.0); }

// The point moved into the texel of a tap; also returns the tests there.
ShadowPoint tapPoint(ShadowPoint p, vec2 place, out float s, out vec3 d) {
  p.texel = ivec2(floor(place));
  p.fraction = fractionOf(place);
  vec4 N;
  s = testNeighbourhood(p, N);
  d = packDiscontinuity(N, s);
  return p;
}

// Counts lit taps, following the edge anew for each.
float filterTaps(ShadowPoint p, SoftReceiver r, vec2 half_texels) {
  float lit = 0.0;
  for (int j = 0; j < FILTER_TAPS; ++j) {
    for (int i = 0; i < FILTER_TAPS; ++i) {
      float s;
      vec3 d;
      ShadowPoint q = tapPoint(p, tapPlace(r, half_texels, ivec2(i, j)), s, d);
      lit += hasEdge(s, d) ? edgeVisibility(d, traverseAll(q, d), q.fraction) : s;
    }
  }
  return lit;
}

// Algorithm 3 as printed. A tap that shares a vertical discontinuity with the tap to its left keeps that tap's vertical
// distances, and moves its horizontal ones by the step between the two (lines 10 to 17). This is wrong if both ends of
// the run are edge ends, or neither is, or if the tap has left the run.
// Two readings: the step, w_p / w_k, is in texels, as the distances are; the paper projects w_p to the near plane, where
// it would be a share of the map. And a tap that keeps its test, as all shadowed ones do in listing 4, is not followed, so
// the next one is.
float filterAsPrinted(ShadowPoint p, SoftReceiver r, vec2 half_texels) {
  precise float h = 2.0 * half_texels.x / float(FILTER_TAPS);
  float lit = 0.0;
  for (int j = 0; j < FILTER_TAPS; ++j) {
    bvec2 before = bvec2(false); // sides of the tap before, +v and -v
    precise vec4 rd = vec4(0.0);
    for (int i = 0; i < FILTER_TAPS; ++i) {
      float s;
      vec3 d;
      ShadowPoint q = tapPoint(p, tapPlace(r, half_texels, ivec2(i, j)), s, d);
      bvec2 sides = discontinuitySides(d).zw;
      bool edge = hasEdge(s, d), same = sides.x && before.x || sides.y && before.y;
      if (edge && !same) rd = fragmentDistance(traverseAll(q, d), q.fraction);
      if (edge && same) rd.xy += rd.y > 0.0 ? -h : h;
      // Keeps the sum of both distances, by which they are divided, from 0.
      if (rd.x == 0.0 && rd.y == 0.0) rd.y = 1e-6;
      lit += edge ? edgeVisibility(d, rd) : s;
      before = bvec2(edge && sides.x, edge && sides.y);
    }
  }
  return lit;
}

// A run along a kernel row, seen from one of its texels.
struct RowRun {
  ivec2 texel;
  vec3 d;
  vec2 t; // signed distances to the left and right ends, from listing 3
};

// Algorithm 3 with lines 10 to 17 corrected. From a texel farther right on the same run, the left end is farther and
// the right end nearer by the same number of texels, whatever kind the ends are. The paper adds a length in uv to
// distances in texels, and its two branches are right only if exactly one end is an edge end. Returns false if the run
// does not reach the texel, differs on other sides, or is not known to its end. An end beyond MAXDIST counts as none,
// as it does when the run is followed.
bool sameRun(RowRun run, ivec2 texel, vec3 d, out vec2 t) {
  ivec2 on = texel - run.texel;
  float by = float(on.x);
  t = vec2(abs(run.t.x) + by, abs(run.t.y) - by);
  t = vec2(t.x > float(MAXDIST) ? -float(MAXDIST + 1) : sign(run.t.x) * t.x, sign(run.t.y) * t.y);
  return on.y == 0 && on.x >= 0 && d.yz == run.d.yz && abs(run.t.y) <= float(MAXDIST) && abs(run.t.y) - by >= 1.0;
}

// Counts lit taps in a window too wide for bits. It tests many taps first and then follows their edges, so that all
// threads of a subgroup walk together. A run that a tap shares with the tap before it is not followed again.
float followTaps(ShadowPoint p, SoftReceiver r, vec2 half_texels) {
  const int TAPS = FILTER_TAPS * FILTER_TAPS, AT_ONCE = 128;
  float lit = 0.0;
  RowRun run = RowRun(ivec2(-0x10000), vec3(0.0), vec2(0.0));
  [[dont_unroll]] for (int first = 0; first < TAPS; first += AT_ONCE) {
    // Taps at edges, one bit each.
    uvec4 open = uvec4(0u);
    [[dont_unroll]] for (int k = 0; k < min(AT_ONCE, TAPS - first); ++k) {
      int tap = first + k;
      float s;
      vec3 d;
      tapPoint(p, tapPlace(r, half_texels, ivec2(tap % FILTER_TAPS, tap / FILTER_TAPS)), s, d);
      if (hasEdge(s, d)) open |= mix(uvec4(0u), uvec4(1u << (k & 31)), equal(ivec4(k >> 5), ivec4(0, 1, 2, 3)));
      else lit += s;
    }
    [[dont_unroll]] while (open != uvec4(0u)) {
      int word = open.x != 0u ? 0 : open.y != 0u ? 1 : open.z != 0u ? 2 : 3;
      uint bits = word == 0 ? open.x : word == 1 ? open.y : word == 2 ? open.z : open.w;
      int tap = first + 32 * word + findLSB(bits);
      open = mix(open, uvec4(bits & bits - 1u), equal(ivec4(word), ivec4(0, 1, 2, 3)));
      float s;
      vec3 d;
      ShadowPoint q = tapPoint(p, tapPlace(r, half_texels, ivec2(tap % FILTER_TAPS, tap / FILTER_TAPS)), s, d);
      vec4 t;
      bool same = sameRun(run, q.texel, d, t.xy);
      [[dont_unroll]] for (int k = same ? 2 : 0; k < 4; ++k) t[k] = traverseShadowSilhouette(q, d, SIDES[k]);
      run = RowRun(q.texel, d, t.xy);
      lit += edgeVisibility(d, t, q.fraction);
    }
  }
  return lit;
}

// Number of taps in each column and row of a window: bit x of word b is bit b of the number in column or row x.
const int COUNT_BITS = FILTER_TAPS < 4 ? 2 : FILTER_TAPS < 16 ? 4 : 6;
uint column_taps[COUNT_BITS], row_taps[COUNT_BITS];

// Assigns the taps to the columns and rows of a window that starts at `first`.
void assignTaps(SoftReceiver r, vec2 half_texels, ivec2 first) {
  [[unroll]] for (int b = 0; b < COUNT_BITS; ++b) column_taps[b] = row_taps[b] = 0u;
  [[dont_unroll]] for (int i = 0; i < FILTER_TAPS; ++i) {
    // Adds one to both numbers.
    uvec2 carry = uvec2(1u) << uvec2(ivec2(floor(tapPlace(r, half_texels, ivec2(i)))) - first);
    [[unroll]] for (int b = 0; b < COUNT_BITS; ++b) {
      uvec2 sum = uvec2(column_taps[b], row_taps[b]) ^ carry;
      carry &= uvec2(column_taps[b], row_taps[b]);
      column_taps[b] = sum.x;
      row_taps[b] = sum.y;
    }
  }
}

// Number of taps in the columns, or rows, of a set.
int tapsInColumns(uint columns) {
  int n = 0;
  [[unroll]] for (int b = 0; b < COUNT_BITS; ++b) n += bitCount(column_taps[b] & columns) << b;
  return n;
}

int tapsInRows(uint rows) {
  int n = 0;
  [[unroll]] for (int b = 0; b < COUNT_BITS; ++b) n += bitCount(row_taps[b] & rows) << b;
  return n;
}

// Counts lit taps in a texel at an edge.
float tapsInTexel(SoftReceiver r, vec2 half_texels, ivec2 texel, vec3 d, vec4 t) {
  ivec2 from = ivec2(tapsInColumns(lineBits(texel.x)), tapsInRows(lineBits(texel.y)));
  ivec2 count = ivec2(tapsInColumns(1u << texel.x), tapsInRows(1u << texel.y));
  float lit = 0.0;
  ivec2 tap = ivec2(0);
  [[dont_unroll]] for (int k = count.x * count.y; k > 0; --k) {
    lit += edgeVisibility(d, t, fractionOf(tapPlace(r, half_texels, from + tap)));
    tap = tap.x + 1 == count.x ? ivec2(0, tap.y + 1) : ivec2(tap.x + 1, tap.y);
  }
  return lit;
}

// Texels of a row that have an edge to follow and taps.
uint openTexels(TexelLine row, int j, ivec2 size, uint tapped) {
  return edgeBits(row, j, size) & tapped & (STAR ? ~0u : row.tests);
}

// Counts lit taps in a window whose texels are tested; follows the edges of each texel once.
float tapsInWindow(ShadowPoint p, SoftReceiver r, vec2 half_texels, ivec2 first, ivec2 size) {
  followBeyond(p, first, size);
  assignTaps(r, half_texels, first);
  // Columns with taps, and rows with texels to follow.
  uint tapped = 0u, open_rows = 0u;
  [[unroll]] for (int b = 0; b < COUNT_BITS; ++b) tapped |= column_taps[b];
  float lit = 0.0;
  [[dont_unroll]] for (int j = 0; j < size.y; ++j) {
    TexelLine row = windowRow(j);
    int rows = tapsInRows(1u << j);
    lit += float(tapsInColumns(row.tests & ~edgeBits(row, j, size)) * rows);
    if (rows > 0 && openTexels(row, j, size, tapped) != 0u) open_rows |= 1u << j;
  }
  // Rows with texels that are left for the last loop.
  uint left_rows = 0u, done = 0u; // done: columns of the row
  [[dont_unroll]] while (open_rows != 0u) {
    int j = findLSB(open_rows);
    TexelLine row = windowRow(j);
    uint open = openTexels(row, j, size, tapped) & ~done;
    ivec2 texel = ivec2(findLSB(open), j);
    open &= open - 1u;
    done = open == 0u ? 0u : ~open;
    if (open == 0u) open_rows &= open_rows - 1u;
    vec3 d;
    vec4 t;
    if (traverseInWindow(row, texel, size, d, t) == 0u) lit += tapsInTexel(r, half_texels, texel, d, t);
    else left_rows |= 1u << j;
  }
  // Texels with runs of their own have a loop of their own, because a loop nested in the one above would run in all of
  // its rounds.
  [[dont_unroll]] while (left_rows != 0u) {
    ivec2 texel = ivec2(-1, findLSB(left_rows));
    TexelLine row = windowRow(texel.y);
    uint open = openTexels(row, texel.y, size, tapped) & ~done, own = 0u;
    vec3 d;
    vec4 t;
    [[dont_unroll]] while (texel.x < 0 && open != 0u) {
      int i = findLSB(open);
      open &= open - 1u;
      own = traverseInWindow(row, ivec2(i, texel.y), size, d, t);
      if (own != 0u) texel.x = i;
    }
    done = open == 0u ? 0u : ~open;
    if (open == 0u) left_rows &= left_rows - 1u;
    if (texel.x < 0) continue;
    followOwn(p, first, size, texel, d, own, t);
    lit += tapsInTexel(r, half_texels, texel, d, t);
  }
  return lit;
}

// Counts lit taps in a window that starts at `first`.
float filterWindow(ShadowPoint p, SoftReceiver r, vec2 half_texels, ivec2 first, ivec2 size) {
  testWindow(p, first, size);
  // Texels of the window and of the ring around it, as bits of rows and columns.
  uint lit_texels = 0u, dark_texels = 0u;
  [[unroll]] for (int k = 0; k < WINDOW_MOST; ++k) {
    lit_texels |= k < size.y ? window_rows[k] : 0u;
    dark_texels |= k < size.y ? ~window_rows[k] & lineBits(size.x) : 0u;
  }
  [[unroll]] for (int k = 0; k < 4; ++k) {
    lit_texels |= window_ring[k];
    dark_texels |= ~window_ring[k] & lineBits(k < 2 ? size.y : size.x);
  }
  float lit = dark_texels == 0u ? float(FILTER_TAPS * FILTER_TAPS) : 0.0;
  if (lit_texels != 0u && dark_texels != 0u) lit = tapsInWindow(p, r, half_texels, first, size);
  return lit;
}

// Mean of the taps over a half-width in texels.
float filterRevectorized(ShadowPoint p, SoftReceiver r, vec2 half_texels) {
  ivec2 first = ivec2(floor(tapPlace(r, half_texels, ivec2(0))));
  ivec2 last = ivec2(floor(tapPlace(r, half_texels, ivec2(FILTER_TAPS - 1))));
  ivec2 size = last - first + 1;
  float lit;
  if (REUSE == EACH_TAP) lit = filterTaps(p, r, half_texels);
  else if (REUSE == AS_PRINTED) lit = filterAsPrinted(p, r, half_texels);
  else if (all(lessThanEqual(size, ivec2(WINDOW_MOST)))) lit = filterWindow(p, r, half_texels, first, size);
  else lit = followTaps(p, r, half_texels);
  // Sums of zeros and ones are exact, so all ways of counting give the same image.
  precise float v = lit / float(FILTER_TAPS * FILTER_TAPS);
  return v;
}

#endif
