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

int lowestBit(uvec2 bits) { return bits.x != 0u ? findLSB(bits.x) : 32 + findLSB(bits.y); }
uvec2 withoutLowest(uvec2 bits) { return bits.x != 0u ? uvec2(bits.x & bits.x - 1u, bits.y) : uvec2(0u, bits.y & bits.y - 1u); }
uvec2 oneBit(int i) { return i < 32 ? uvec2(1u << i, 0u) : uvec2(0u, 1u << (i - 32)); }

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

// Counts lit taps in a window too wide for bits. It tests all taps first and then follows the edges, so that all
// threads of a subgroup walk together. A run that a tap shares with the tap before it is not followed again.
float followTaps(ShadowPoint p, SoftReceiver r, vec2 half_texels) {
  float lit = 0.0;
  // Taps at edges: a bit per column, and a bit for each row that has any.
  uvec2 open[FILTER_TAPS];
  uvec2 open_rows = uvec2(0u);
  for (int j = 0; j < FILTER_TAPS; ++j) {
    uvec2 row = uvec2(0u);
    for (int i = 0; i < FILTER_TAPS; ++i) {
      float s;
      vec3 d;
      tapPoint(p, tapPlace(r, half_texels, ivec2(i, j)), s, d);
      if (hasEdge(s, d)) row |= oneBit(i);
      else lit += s;
    }
    open[j] = row;
    if (row != uvec2(0u)) open_rows |= oneBit(j);
  }
  RowRun run = RowRun(ivec2(-0x10000), vec3(0.0), vec2(0.0));
  while (open_rows != uvec2(0u)) {
    int j = lowestBit(open_rows), i = lowestBit(open[j]);
    open[j] = withoutLowest(open[j]);
    if (open[j] == uvec2(0u)) open_rows = withoutLowest(open_rows);
    float s;
    vec3 d;
    ShadowPoint q = tapPoint(p, tapPlace(r, half_texels, ivec2(i, j)), s, d);
    vec4 t;
    bool same = sameRun(run, q.texel, d, t.xy);
    for (int k = same ? 2 : 0; k < 4; ++k) t[k] = traverseShadowSilhouette(q, d, SIDES[k]);
    run = RowRun(q.texel, d, t.xy);
    lit += edgeVisibility(d, t, q.fraction);
  }
  return lit;
}

// First tap in each column and row of a window, plus COUNT_UNIT times the number of taps there.
int column_taps[WINDOW_MOST], row_taps[WINDOW_MOST];
const int COUNT_UNIT = 64;

// Assigns the taps to the columns and rows of a window that starts at `first`. Returns bits of the columns and of the
// rows that have taps.
uvec2 assignTaps(SoftReceiver r, vec2 half_texels, ivec2 first) {
  ivec2 before = ivec2(-1);
  uvec2 tapped = uvec2(0u);
  for (int i = 0; i < FILTER_TAPS; ++i) {
    ivec2 at = ivec2(floor(tapPlace(r, half_texels, ivec2(i)))) - first;
    column_taps[at.x] = at.x == before.x ? column_taps[at.x] + COUNT_UNIT : i + COUNT_UNIT;
    row_taps[at.y] = at.y == before.y ? row_taps[at.y] + COUNT_UNIT : i + COUNT_UNIT;
    tapped |= uvec2(1u) << uvec2(at);
    before = at;
  }
  return tapped;
}

// Stores the tests of the window and its ring as bits.
void testWindow(ShadowPoint p, ivec2 first, ivec2 size) {
  for (int i = 0; i < size.x + 2; ++i) window_columns[i] = 0u;
  for (int j = 0; j < size.y + 2; j += 2) {
    // Bit i is the ring's column i.
    uint upper = 0u, lower = 0u;
    for (int i = 0; i < size.x + 2; i += 2) {
      uint tests = shadowTest2x2(p, first - 1 + ivec2(i, j));
      upper |= (tests & 3u) << i;
      lower |= tests >> 2 << i;
      window_columns[i] |= (tests & 1u | tests >> 1 & 2u) << j;
      window_columns[i + 1] |= (tests >> 1 & 1u | tests >> 2 & 2u) << j;
    }
    window_rows[j] = upper >> 1 & lineBits(size.x);
    window_rows[j + 1] = lower >> 1 & lineBits(size.x);
  }
  for (int i = 0; i < size.x + 2; ++i) window_columns[i] = window_columns[i] >> 1 & lineBits(size.y);
}

// Counts lit taps in a texel at an edge.
float tapsInTexel(SoftReceiver r, vec2 half_texels, ivec2 texel, vec3 d, vec4 t) {
  int columns = column_taps[texel.x], rows = row_taps[texel.y];
  ivec2 from = ivec2(columns, rows) & (COUNT_UNIT - 1), count = ivec2(columns, rows) / COUNT_UNIT;
  float lit = 0.0;
  ivec2 tap = ivec2(0);
  for (int k = count.x * count.y; k > 0; --k) {
    lit += edgeVisibility(d, t, fractionOf(tapPlace(r, half_texels, from + tap)));
    tap = tap.x + 1 == count.x ? ivec2(0, tap.y + 1) : ivec2(tap.x + 1, tap.y);
  }
  return lit;
}

// Counts lit taps in a window that starts at `first`; follows the edges of each texel once.
float filterWindow(ShadowPoint p, SoftReceiver r, vec2 half_texels, ivec2 first, ivec2 size) {
  uvec2 tapped = assignTaps(r, half_texels, first);
  testWindow(p, first, size);
  followBeyond(p, first, size);
  float lit = 0.0;
  // Texels that have an edge and taps: a bit per column, and a bit for each row that has any.
  uint open[WINDOW_MOST], later[WINDOW_MOST];
  uint open_rows = 0u, later_rows = 0u;
  for (uint rows = tapped.y; rows != 0u; rows &= rows - 1u) {
    int y = findLSB(rows);
    uint left, right, tests = window_rows[y + 1], edges = edgeBits(y, size, left, right);
    int uniform_lit = 0;
    for (uint columns = tests & ~edges & tapped.x; columns != 0u; columns &= columns - 1u) {
      uniform_lit += column_taps[findLSB(columns)] / COUNT_UNIT;
    }
    lit += float(uniform_lit * (row_taps[y] / COUNT_UNIT));
    open[y] = edges & tapped.x & (STAR ? ~0u : tests);
    later[y] = 0u;
    if (open[y] != 0u) open_rows |= 1u << y;
  }
  while (open_rows != 0u) {
    ivec2 texel;
    texel.y = findLSB(open_rows);
    uint columns = open[texel.y];
    texel.x = findLSB(columns);
    open[texel.y] = columns & columns - 1u;
    if ((columns & columns - 1u) == 0u) open_rows &= open_rows - 1u;
    vec3 d;
    vec4 t;
    if (traverseInWindow(texel, size, d, t)) {
      lit += tapsInTexel(r, half_texels, texel, d, t);
    } else {
      later[texel.y] |= 1u << texel.x;
      later_rows |= 1u << texel.y;
    }
  }
  // Only a few texels are left, and each is followed for itself. They have a loop of their own, because a loop nested
  // in the one above would run in all of its rounds.
  while (later_rows != 0u) {
    ivec2 texel;
    texel.y = findLSB(later_rows);
    uint columns = later[texel.y];
    texel.x = findLSB(columns);
    later[texel.y] = columns & columns - 1u;
    if ((columns & columns - 1u) == 0u) later_rows &= later_rows - 1u;
    float s;
    vec3 d;
    ShadowPoint q = tapPoint(p, vec2(first + texel) + 0.5, s, d);
    lit += tapsInTexel(r, half_texels, texel, d, traverseAll(q, d));
  }
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
