// Revectorization-based shadow mapping: [JCGT] Macedo, Apolinario, Aguero, "Optimized visibility functions for
// revectorization-based shadow mapping", listings 1 to 5, under the listings' names.
// Binding-free: the includer defines the shadow test after this file, reading its map as it likes:
//
//   float shadowTest(ShadowPoint p, ivec2 texel) { return receiverDepth(p, texel) > depth of texel ? 0.0 : 1.0; }
//
// and may define MAXDIST before it, the longest edge in texels. glsl/README.md has a whole example. Runs are followed
// 2 x 2 texels at a time: with RBSM_GATHER defined before, the includer also defines shadowTest2x2, by one textureGather.
//
// Departures from the listings, each with its reason:
// * Texels are addressed by index. The listings add the texel's size to a float coordinate, which after many steps
//   crosses a texel's border.
// * A test at another texel compares with the receiver's plane at that texel's centre (`dz`). The listings keep
//   np.z = p.z, which misfires on any receiver that is not parallel to the map; `dz = 0` brings that back.
// * Listing 3 returns vec2 and takes a vec2 d of which it reads z; its loop variable is misspelt. Here a float, a vec3.
// * checkDiscontinuity is not listed: the two texels have a discontinuity direction in common. Along a run only the
//   sides across it can be, so only those are tested (followShadowEdge).
// * A run that reaches MAXDIST counts as stepped out: its far end is not known.
// * computeFragmentDistanceToSE and normalizeFragmentDistanceToSE are not listed; they follow the text and "Revectorization-
//   Based Soft Shadow Mapping" eq. 2 and 3, the latter with max(d_t, d_b) in its second component instead of max(d_l, d_b).
// * Table 1 swaps top and bottom against listing 2; listing 2 counts: left, right, +v, -v.
// * Listing 5 tests nrd.w == 1 for the I shape; it must be -1. All its values are clamped: where one axis ended twice and
//   the other not at all, the second position is negative.
#ifndef EDGESHADE_RBSM
#define EDGESHADE_RBSM

#ifndef MAXDIST
#define MAXDIST 16
#endif

// Sides of a texel, in the order of listing 2: left, right, +v, -v.
const ivec2 SIDES[4] = ivec2[](ivec2(-1, 0), ivec2(1, 0), ivec2(0, 1), ivec2(0, -1));

// A fragment in the shadow map.
struct ShadowPoint {
  ivec2 texel;   // the texel that it falls into
  vec2 fraction; // its place in there, in (0, 1)
  ivec2 origin;  // the texel that z belongs to: `texel`, but for the samples of a filter
  float z;       // depth of the receiver's plane at the origin's centre, bias taken off; or the fragment's own depth
  vec2 dz;       // change of the plane's depth a texel; 0: the fixed depth of the listings
  float slack;   // depth a texel of distance by which a curved receiver may lie before its plane; 0: a plane
};

// Lit is 1, in shadow 0: [JCGT] eq. 1. Defined by the includer.
float shadowTest(ShadowPoint p, ivec2 texel);

// Tests of `corner` and of the texels right, below, and right below: bits 0 to 3.
uint shadowTest2x2(ShadowPoint p, ivec2 corner);

#ifndef RBSM_GATHER
uint shadowTest2x2(ShadowPoint p, ivec2 corner) {
  uint tests = 0u;
  for (int i = 0; i < 4; ++i) tests |= uint(shadowTest(p, corner + ivec2(i & 1, i >> 1))) << i;
  return tests;
}
#endif

// `place` is uv times the map's size. `z` belongs to the place, not to the texel's centre.
ShadowPoint shadowPoint(vec2 place, float z, vec2 dz, float slack) {
  precise ShadowPoint p;
  vec2 first = floor(place);
  p.texel = p.origin = ivec2(first);
  // Neither 0 nor 1: distances carry a sign.
  p.fraction = clamp(place - first, vec2(1e-7), vec2(1.0 - 6e-8));
  p.dz = dz;
  p.slack = slack;
  p.z = z + dot(dz, first + 0.5 - place);
  return p;
}

// Depth to compare with a texel's.
float receiverDepth(ShadowPoint p, ivec2 texel) {
  vec2 away = vec2(texel - p.origin);
  precise float z = p.z + (away.x * p.dz.x + away.y * p.dz.y) - (abs(away.x) + abs(away.y)) * p.slack;
  return z;
}

// Listing 2: tests of the neighbours, in the order left, right, +v, -v.
vec4 computeN(ShadowPoint p) {
  vec4 N;
  for (int k = 0; k < 4; ++k) N[k] = shadowTest(p, p.texel + SIDES[k]);
  return N;
}

// From the neighbours' tests and the texel's own. x and y are 0.5 for left and +v, plus 0.25 for right and -v; z is 1 in
// shadow.
vec3 packDiscontinuity(vec4 N, float s) {
  vec4 dU = abs(N - s);
  return vec3((2.0 * dU.xz + dU.yw) / 4.0, 1.0 - s);
}

vec3 computeDiscontinuity(ShadowPoint p, float s) { return packDiscontinuity(computeN(p), s); }

// Sides on which there is a discontinuity: left, right, +v, -v.
bvec4 discontinuitySides(vec3 d) {
  return bvec4(d.x >= 0.5, d.x == 0.25 || d.x == 0.75, d.y >= 0.5, d.y == 0.25 || d.y == 0.75);
}

// Tests along a run, two texels at a time, in a run's own terms whatever its direction.
struct RunTests {
  ivec2 offset; // from the nearer of the two texels to the block's corner
  ivec4 bits;   // in the block: the nearer texel, the farther, their neighbours across
};

RunTests runTests(ivec2 dir, ivec2 across) {
  RunTests r;
  r.offset = min(dir, ivec2(0)) + min(across, ivec2(0));
  ivec2 at = -r.offset;
  int nearer = at.x + 2 * at.y, along = dir.x + 2 * dir.y, sideways = across.x + 2 * across.y;
  r.bits = nearer + ivec4(0, along, sideways, along + sideways);
  return r;
}

// Which of the four differ from s: the texel at `texel`, the next one, the neighbours across of both.
bvec4 runDiffers(ShadowPoint p, RunTests r, ivec2 texel, float s) {
  uint tests = shadowTest2x2(p, texel + r.offset) ^ (s == 0.0 ? 0u : 15u);
  return notEqual(uvec4(tests) >> r.bits & 1u, uvec4(0u));
}

// Listing 3 from any texel: the texels after it in direction `dir` are followed while their test is s and a texel across
// differs, on one of the sides that `sides` names: x is the side `across`, y the opposite.
int followShadowEdge(ShadowPoint p, ivec2 texel, ivec2 dir, ivec2 across, float s, bvec2 sides) {
  // The listing's checkDiscontinuity: whether the two texels have a discontinuity direction in common. Along a run only
  // the sides across it can be.
  bool both = sides.x && sides.y;
  RunTests r = runTests(dir, sides.x || !sides.y ? across : -across), other = runTests(dir, -across);
  bool any_side = sides.x || sides.y;
  for (int i = 1; i <= MAXDIST; i += 2) {
    texel += dir;
    bvec4 differs = runDiffers(p, r, texel, s);
    bvec2 shares = bvec2(any_side && differs.z, any_side && differs.w);
    if (both) {
      bvec4 more = runDiffers(p, other, texel, s);
      shares = bvec2(shares.x || more.z, shares.y || more.w);
    }
    if (differs.x) return i;
    if (!shares.x) return -i;
    if (i == MAXDIST) break;
    if (differs.y) return i + 1;
    if (!shares.y) return -(i + 1);
    texel += dir;
  }
  return -(MAXDIST + 1);
}

// Listing 3: texels to the end of the run in a direction, 1 or more; positive where it ends at a texel of the other
// visibility, negative where it steps out of the edge, or reaches MAXDIST.
float traverseShadowSilhouette(ShadowPoint p, vec3 d, ivec2 dir) {
  bvec4 sides = discontinuitySides(d);
  ivec2 across = dir.x != 0 ? ivec2(0, 1) : ivec2(-1, 0);
  return float(followShadowEdge(p, p.texel, dir, across, 1.0 - d.z, dir.x != 0 ? sides.zw : sides.xy));
}

// Signed distances in texels from a place in a texel to the ends of the edge, from those of the texel; in the order of
// SIDES.
vec4 fragmentDistance(vec4 t, vec2 fraction) {
  vec4 c = vec4(fraction.x, 1.0 - fraction.x, 1.0 - fraction.y, fraction.y);
  return sign(t) * (c + (abs(t) - 1.0));
}

// Listing 3 in all four directions.
vec4 traverseAll(ShadowPoint p, vec3 d) {
  vec4 t;
  // A loop, so that the traversal's code is there once.
  for (int k = 0; k < 4; ++k) t[k] = traverseShadowSilhouette(p, d, SIDES[k]);
  return t;
}

vec4 computeFragmentDistanceToSE(ShadowPoint p, vec3 d) { return fragmentDistance(traverseAll(p, d), p.fraction); }

// x, y: place in the edge from the end found, 0, to the other, 1; with two ends, from the nearer to the farther.
// z, w: both ends of the axis were found 1, one 0, none -1.
vec4 normalizeFragmentDistanceToSE(vec4 rd) {
  precise vec4 nrd;
  nrd.xy = max(rd.xz, rd.yw) / (abs(rd.xz) + abs(rd.yw));
  nrd.zw = 0.5 * (sign(rd.xz) + sign(rd.yw));
  return nrd;
}

// Listing 4: the visibility of a lit fragment at an edge.
float recoverSilhouette(vec3 d, vec4 nrd) {
  // Short U or O, long U or O.
  if (d.x == 0.75 || d.y == 0.75) return 0.0;
  if (nrd.z == 1.0 || nrd.w == 1.0) return 0.0;
  // I.
  if (nrd.z == -1.0 || nrd.w == -1.0) return 1.0;
  // L.
  return step(1.0 - nrd.x, nrd.y);
}

// Listing 5: the visibility of a fragment on either side of an edge.
float filterSilhouette(vec3 d, vec4 nrd) {
  precise float v;
  float sign = -2.0 * d.z + 1.0;
  // Short O, long O.
  if (d.x == 0.75 && d.y == 0.75 || nrd.z == 1.0 && nrd.w == 1.0) v = d.z;
  // U.
  else if (nrd.z == 1.0) v = d.z + sign * nrd.y;
  else if (nrd.w == 1.0) v = d.z + sign * nrd.x;
  // I.
  else if (nrd.z == -1.0 || nrd.w == -1.0) v = 1.0 - d.z;
  // L.
  else v = d.z + sign * nrd.y + sign * nrd.x;
  return clamp(v, 0.0, 1.0);
}

// What listings 4 and 5 both call computeRBSMVisibility.
float computeRBSMVisibility(vec3 d, vec4 nrd, bool silhouette_recovery) {
  return silhouette_recovery ? recoverSilhouette(d, nrd) : filterSilhouette(d, nrd);
}

// Listing 1 from where the discontinuity is known: for fragments at an edge.
float revectorizeShadowEdge(ShadowPoint p, vec3 d, bool silhouette_recovery) {
  vec4 rd = computeFragmentDistanceToSE(p, d);
  vec4 nrd = normalizeFragmentDistanceToSE(rd);
  return computeRBSMVisibility(d, nrd, silhouette_recovery);
}

// Listing 1.
float RBSM(ShadowPoint p, bool silhouette_recovery) {
  float s = shadowTest(p, p.texel);
  if (silhouette_recovery && s == 0.0) return s;
  vec3 d = computeDiscontinuity(p, s);
  return d.x > 0.0 || d.y > 0.0 ? revectorizeShadowEdge(p, d, silhouette_recovery) : s;
}

#endif
