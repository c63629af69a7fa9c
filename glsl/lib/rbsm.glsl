// Revectorization-based shadow mapping: [JCGT] Macedo, Apolinario, Aguero, "Optimized visibility functions for
// revectorization-based shadow mapping", listings 1 to 5, under the listings' names.
// Binding-free: after this file the including shader defines the shadow test over its own map:
//
//   float shadowTest(ShadowPoint p, ivec2 texel) { return receiverDepth(p, texel) > depth of texel ? 0.0 : 1.0; }
//
// It may define MAXDIST, the longest edge in texels, before this file. glsl/README.md has a whole example. Runs are
// followed 2 x 2 texels at a time. With RBSM_GATHER defined before this file, the shader also defines shadowTest2x2 by
// one textureGather.
//
// Departures from the listings:
// * Texels are addressed by index. The listings add the texel's size to a float coordinate, which crosses a texel's
//   border after many steps.
// * A test at another texel compares with the receiver's plane at that texel's centre (`dz`). The listings keep
//   np.z = p.z, which fails on any receiver that is not parallel to the map. `dz = 0` gives the listings' form.
// * Listing 3 returns a vec2 and takes a vec2 d but reads its z; its loop variable is misspelt. Here these are a float
//   and a vec3.
// * checkDiscontinuity is not listed. It tests whether the two texels have a discontinuity direction in common. Along a
//   run only the sides across it can be shared, so only those are tested (followShadowEdge).
// * A run that reaches MAXDIST counts as stepped out, since its far end is not known.
// * computeFragmentDistanceToSE and normalizeFragmentDistanceToSE are not listed. They follow the text and eq. 2 and 3
//   of "Revectorization-Based Soft Shadow Mapping", with max(d_t, d_b) in the second component of eq. 3 instead of
//   max(d_l, d_b).
// * Table 1 swaps top and bottom against listing 2. Listing 2 counts: left, right, +v, -v.
// * Listing 5 tests nrd.w == 1 for the I shape; it must be -1. All its values are clamped: where one axis ended twice
//   and the other not at all, the second position is negative.
#ifndef EDGESHADE_RBSM
#define EDGESHADE_RBSM

#ifndef MAXDIST
#define MAXDIST 16
#endif

// Sides of a texel, in the order of listing 2: left, right, +v, -v.
const ivec2 SIDES[4] = ivec2[](ivec2(-1, 0), ivec2(1, 0), ivec2(0, 1), ivec2(0, -1));

// A fragment's point in the shadow map.
struct ShadowPoint {
  ivec2 texel;   // texel that it falls into
  vec2 fraction; // place within the texel, in (0, 1)
  ivec2 origin;  // texel that z belongs to: `texel`, except for the samples of a filter
  float z;       // depth of the receiver's plane at the origin's centre, bias subtracted; or the fragment's own depth
  vec2 dz;       // change of the plane's depth per texel; 0: the fixed depth of the listings
  float slack;   // depth per texel of distance by which a curved receiver may lie in front of its plane; 0: plane
};

// [JCGT] eq. 1: 1 if lit, 0 in shadow. Defined by the including shader.
float shadowTest(ShadowPoint p, ivec2 texel);

// Tests of `corner` (bit 0) and of the texels to its right, below it, and right below it (bits 1 to 3).
uint shadowTest2x2(ShadowPoint p, ivec2 corner);

#ifndef RBSM_GATHER
uint shadowTest2x2(ShadowPoint p, ivec2 corner) {
  uint tests = 0u;
  for (int i = 0; i < 4; ++i) tests |= uint(shadowTest(p, corner + ivec2(i & 1, i >> 1))) << i;
  return tests;
}
#endif

// `place` is uv times the map's size. `z` is the depth at the place, not at the texel's centre.
ShadowPoint shadowPoint(vec2 place, float z, vec2 dz, float slack) {
  precise ShadowPoint p;
  vec2 first = floor(place);
  p.texel = p.origin = ivec2(first);
  // Neither 0 nor 1, so that signed distances keep their sign.
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

// Packs the tests of the neighbours and of the texel itself. x and y are 0.5 for left and +v, plus 0.25 for right and
// -v; z is 1 in shadow.
vec3 packDiscontinuity(vec4 N, float s) {
  vec4 dU = abs(N - s);
  return vec3((2.0 * dU.xz + dU.yw) / 4.0, 1.0 - s);
}

vec3 computeDiscontinuity(ShadowPoint p, float s) { return packDiscontinuity(computeN(p), s); }

// Sides on which there is a discontinuity: left, right, +v, -v.
bvec4 discontinuitySides(vec3 d) {
  return bvec4(d.x >= 0.5, d.x == 0.25 || d.x == 0.75, d.y >= 0.5, d.y == 0.25 || d.y == 0.75);
}

// A block of 2 x 2 texels along a run, addressed relative to the run's direction.
struct RunTests {
  ivec2 offset; // from the nearer of the two texels on the run to the block's corner
  ivec4 bits;   // bit index of the nearer texel, the farther one, and the neighbours across of both
};

RunTests runTests(ivec2 dir, ivec2 across) {
  RunTests r;
  r.offset = min(dir, ivec2(0)) + min(across, ivec2(0));
  ivec2 at = -r.offset;
  int nearer = at.x + 2 * at.y, along = dir.x + 2 * dir.y, sideways = across.x + 2 * across.y;
  r.bits = nearer + ivec4(0, along, sideways, along + sideways);
  return r;
}

// Tells which of four texels differ from s: the texel at `texel`, the next one, and the neighbours across of both.
bvec4 runDiffers(ShadowPoint p, RunTests r, ivec2 texel, float s) {
  uint tests = shadowTest2x2(p, texel + r.offset) ^ (s == 0.0 ? 0u : 15u);
  return notEqual(uvec4(tests) >> r.bits & 1u, uvec4(0u));
}

// Listing 3 from any texel. Follows the texels after it in direction `dir` while their test is s and a texel across
// differs, on one of the sides in `sides`: x is the side `across`, y the opposite one.
int followShadowEdge(ShadowPoint p, ivec2 texel, ivec2 dir, ivec2 across, float s, bvec2 sides) {
  // checkDiscontinuity of the listing: the two texels have a discontinuity direction in common. Along a run only the
  // sides across it can be shared.
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

// Listing 3: number of texels to the end of the run in a direction, at least 1. Positive if the run ends at a texel of
// the other visibility, negative if it steps out of the edge or reaches MAXDIST.
float traverseShadowSilhouette(ShadowPoint p, vec3 d, ivec2 dir) {
  bvec4 sides = discontinuitySides(d);
  ivec2 across = dir.x != 0 ? ivec2(0, 1) : ivec2(-1, 0);
  return float(followShadowEdge(p, p.texel, dir, across, 1.0 - d.z, dir.x != 0 ? sides.zw : sides.xy));
}

// Signed distances in texels from a place in a texel to the ends of the edge, given those of the texel; in the order of
// SIDES.
vec4 fragmentDistance(vec4 t, vec2 fraction) {
  vec4 c = vec4(fraction.x, 1.0 - fraction.x, 1.0 - fraction.y, fraction.y);
  return sign(t) * (c + (abs(t) - 1.0));
}

// Listing 3 in all four directions.
vec4 traverseAll(ShadowPoint p, vec3 d) {
  vec4 t;
  // A loop keeps a single copy of the traversal's code.
  for (int k = 0; k < 4; ++k) t[k] = traverseShadowSilhouette(p, d, SIDES[k]);
  return t;
}

vec4 computeFragmentDistanceToSE(ShadowPoint p, vec3 d) { return fragmentDistance(traverseAll(p, d), p.fraction); }

// x, y: position along the edge, from 0 at the end that was found to 1 at the other. With two ends it is the distance
// from the farther one: half in the middle, 1 at either end.
// z, w: 1 if both ends of the axis were found, 0 if one was, -1 if none.
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

// Visibility of a fragment at an edge. Listing 4 and listing 5 both have this name for their functions.
float computeRBSMVisibility(vec3 d, vec4 nrd, bool silhouette_recovery) {
  return silhouette_recovery ? recoverSilhouette(d, nrd) : filterSilhouette(d, nrd);
}

// Listing 1 for fragments at an edge, once the discontinuity is known.
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
