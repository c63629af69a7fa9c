// Revectorization as it was published, function by function and in the order of the printed lines.
//
//   [JCGT] Macedo, Apolinario, Aguero, "Optimized visibility functions for revectorization-based shadow mapping"
//          (2017): listings 1 to 5.
//   [CGF]  Macedo, Apolinario, Aguero, "Revectorization-based soft shadow mapping" (2019): eq. 2 and 3, which [JCGT]
//          uses and does not print.
//   [CG]   Macedo, Apolinario, "Improved anti-aliasing for Euclidean distance transform shadow mapping" (2018): eq. 4
//          to 10.
//
// Read this file beside the papers. lib/rbsm.glsl computes the same images, bit for bit, with fewer fetches.
//
// Binding-free: after this file the including shader defines the shadow test ([JCGT] eq. 1) of a texel of its own map,
// 1 if the point is lit and 0 if it is in shadow:
//
//   float shadowTest(vec3 p, ivec2 texel) { return p.z > depth of texel ? 0.0 : 1.0; }
//
// It may define MAXDIST before this file. A point `p` is the fragment in the shadow map: p.xy is its place in texels
// (uv times the map's size), p.z its depth with the bias subtracted. In the listings p.xy is uv.
//
// Departures, each marked where it is:
//   INDEX    Texels are addressed by index. The listings add the texel's size `o` to a float coordinate, which crosses
//            a texel's border after many steps. So `o` is gone, and directions are whole texels.
//   ERRATUM  The printed line cannot be meant:
//            - [JCGT] listing 3 returns a vec2 and takes a vec2 d, but reads its z. These are a float and a vec3 here.
//              Its loop variable is misspelt.
//            - [JCGT] listing 5 tests nrd.w == 1 for the I shape. It must be -1: every case with w == 1 has returned.
//            - [JCGT] table 1 swaps top and bottom against listing 2. Listing 2 counts: left, right, +v, -v.
//            - [CGF] eq. 3 has max(d_l, d_b) in its second component. It must be max(d_t, d_b).
//            - Where one axis ended twice and the other not at all, the second position is negative. Listing 5 clamps
//              its last return alone; here all are clamped.
//   SILENT   The papers name a function and do not print it.
//
// Contradictions between the papers:
//   - [JCGT] 3.2.1 says that lit and shadowed fragments share one origin, and 3.2.4 that for shadowed fragments two
//     ends mean I and none means U or O. This file follows listing 5 and [CG] 3.2, which say otherwise: each side
//     measures from the corner where its own run ends, and ends mean the same on both sides.
//   - The text after [CG] eq. 5 says that a shadowed fragment becomes lit where alpha is at least 0.5. Eq. 5 and 7 say
//     up to 0.5; this file follows them.
//   - [CGF] ends a traversal at a texel without any discontinuity, [JCGT] and [CG] where no direction is shared with
//     the start. This file follows the latter.
// A run that reaches MAXDIST returns -(MAXDIST + 1), as in the printed loop: its far end counts as stepped out.
// Listing 5 makes a shadow bar of one texel's width vanish: it has two ends across and none along, so the position
// along is negative, or it is closed as a long O. computeRBSMStarRamp of lib/rbsm_star.glsl keeps such bars.
#ifndef EDGESHADE_RBSM_LISTINGS
#define EDGESHADE_RBSM_LISTINGS

#ifndef MAXDIST
#define MAXDIST 16
#endif

float shadowTest(vec3 p, ivec2 texel);

// INDEX: the texel that a point falls into.
ivec2 texelOf(vec3 p) { return ivec2(floor(p.xy)); }

// [JCGT] listing 2: shadow tests of the 4-connected neighbours: left, right, +v, -v.
vec4 computeN(vec3 p, ivec2 texel) {
  vec4 N;
  N.x = shadowTest(p, texel + ivec2(-1, 0));
  N.y = shadowTest(p, texel + ivec2(1, 0));
  N.z = shadowTest(p, texel + ivec2(0, 1));
  N.w = shadowTest(p, texel + ivec2(0, -1));
  return N;
}

// [JCGT] listing 2: directions of the discontinuities of a texel (xy), and 1 - shadow test (z). x is 0.5 for left plus
// 0.25 for right, y 0.5 for +v plus 0.25 for -v.
vec3 computeDiscontinuity(vec3 p, ivec2 texel) {
  // Shadow test of the fragment.
  float s = shadowTest(p, texel);
  // Shadow tests of the neighbourhood.
  vec4 N = computeN(p, texel);
  // Directions of the discontinuities.
  vec4 dU = abs(N - s);
  vec2 dC = (2.0 * dU.xz + dU.yw) / 4.0;
  return vec3(dC, 1.0 - s);
}

// SILENT, used by [JCGT] listing 3: tests whether two texels have a direction of discontinuity in common.
bool checkDiscontinuity(vec3 p, ivec2 texel, vec3 d) {
  vec3 nd = computeDiscontinuity(p, texel);
  bvec2 first = bvec2(nd.x >= 0.5 && d.x >= 0.5, nd.y >= 0.5 && d.y >= 0.5);
  bvec2 second = bvec2((nd.x == 0.25 || nd.x == 0.75) && (d.x == 0.25 || d.x == 0.75),
                       (nd.y == 0.25 || nd.y == 0.75) && (d.y == 0.25 || d.y == 0.75));
  return any(first) || any(second);
}

// [JCGT] listing 3: texels to the end of the shadow edge in a direction. Positive if the edge ends there, at a texel of
// the other visibility; negative if the traversal stepped out of the edge. ERRATUM: types of d and of the result.
float traverseShadowSilhouette(vec3 p, vec3 d, ivec2 dir) {
  float shadowEdgeEnd = 0.0;
  float distance = 1.0;
  bool hasDiscontinuity = false;
  // INDEX: the neighbour of p; its depth stays that of p.
  ivec2 np = texelOf(p);
  // ERRATUM: the printed loop declares i and counts it.
  for (int it = 0; it < MAXDIST; it++) {
    // The next neighbour.
    np += dir;
    // Visibility of np.
    float s = shadowTest(p, np);
    // The visibility of p and np differs: the edge ends.
    if (abs(s - d.z) == 0.0) {
      shadowEdgeEnd = 1.0;
      break;
    } else {
      // It is the same: np must have a direction of discontinuity in common with p.
      hasDiscontinuity = checkDiscontinuity(p, np, d);
      if (!hasDiscontinuity) break;
    }
    distance++;
  }
  return mix(-distance, distance, shadowEdgeEnd);
}

// SILENT, used by [JCGT] listing 1: signed distances of the fragment to the ends of the edge in texels, left, right, +v
// and -v, after the text of [CGF] before eq. 2.
vec4 computeFragmentDistanceToSE(vec3 p, vec3 d) {
  vec4 t;
  t.x = traverseShadowSilhouette(p, d, ivec2(-1, 0));
  t.y = traverseShadowSilhouette(p, d, ivec2(1, 0));
  t.z = traverseShadowSilhouette(p, d, ivec2(0, 1));
  t.w = traverseShadowSilhouette(p, d, ivec2(0, -1));
  // Place within the texel. INDEX: neither 0 nor 1, so that no distance is 0 and loses its sign.
  vec2 c = clamp(p.xy - floor(p.xy), vec2(1e-7), vec2(1.0 - 6e-8));
  return sign(t) * (vec4(c.x, 1.0 - c.x, 1.0 - c.y, c.y) + (abs(t) - 1.0));
}

// SILENT, used by [JCGT] listing 1: [CGF] eq. 3 (ERRATUM) in xy, the position along each axis, and [JCGT] eq. 5 in zw:
// 1 if both ends of the axis were found, 0 if one was, -1 if none.
vec4 normalizeFragmentDistanceToSE(vec4 rd) {
  precise vec4 nrd;
  nrd.x = max(rd.x, rd.y) / (abs(rd.x) + abs(rd.y));
  nrd.y = max(rd.z, rd.w) / (abs(rd.z) + abs(rd.w));
  nrd.z = 0.5 * (sign(rd.x) + sign(rd.y));
  nrd.w = 0.5 * (sign(rd.z) + sign(rd.w));
  return nrd;
}

// [JCGT] listing 4, silhouette recovery. It prints the name computeRBSMVisibility, as listing 5 does.
float recoverSilhouette(vec3 d, vec4 nrd) {
  // Short U or O: shadow.
  if (d.x == 0.75 || d.y == 0.75) return 0.0;
  // Long U or O: shadow.
  if (nrd.z == 1.0 || nrd.w == 1.0) return 0.0;
  // I: lit.
  if (nrd.z == -1.0 || nrd.w == -1.0) return 1.0;
  // L: the revectorized edge.
  return step(1.0 - nrd.x, nrd.y);
}

// [JCGT] listing 5, filtering. ERRATUM: every result is clamped.
float filterSilhouette(vec3 d, vec4 nrd) {
  precise float v;
  float sign = -2.0 * d.z + 1.0;
  // Short O: the opposite of the shadow test.
  if (d.x == 0.75 && d.y == 0.75) v = d.z;
  // Long O: the opposite of the shadow test.
  else if (nrd.z == 1.0 && nrd.w == 1.0) v = d.z;
  // U: the normalized distance.
  else if (nrd.z == 1.0) v = d.z + sign * nrd.y;
  else if (nrd.w == 1.0) v = d.z + sign * nrd.x;
  // I: the shadow test. ERRATUM: -1 twice.
  else if (nrd.z == -1.0 || nrd.w == -1.0) v = 1.0 - d.z;
  // L: the filtered edge.
  else v = d.z + sign * nrd.y + sign * nrd.x;
  return clamp(v, 0.0, 1.0);
}

float computeRBSMVisibility(vec3 d, vec4 nrd, bool silhouetteRecovery) {
  return silhouetteRecovery ? recoverSilhouette(d, nrd) : filterSilhouette(d, nrd);
}

// [JCGT] listing 1.
float RBSM(vec3 p, bool silhouetteRecovery) {
  // Shadow test. INDEX: it fetches the blocker's depth itself.
  float shadowTestResult = shadowTest(p, texelOf(p));
  // For silhouette recovery, shadowed fragments are done.
  if (silhouetteRecovery) {
    if (shadowTestResult == 0.0) return shadowTestResult;
  }
  vec3 d = computeDiscontinuity(p, texelOf(p));
  // Is the fragment at a shadow edge?
  if (d.r > 0.0 || d.g > 0.0) {
    // Relative distance of p to the ends of the edge, and the same normalized to the unit interval.
    vec4 rd = computeFragmentDistanceToSE(p, d);
    vec4 nrd = normalizeFragmentDistanceToSE(rd);
    // Revectorize the edge.
    return computeRBSMVisibility(d, nrd, silhouetteRecovery);
  } else return shadowTestResult;
}

// [CG] eq. 4, the original visibility function: the line of listing 4. `alpha` is the position along both axes.
float originalVisibility(vec2 alpha) { return 1.0 - alpha.x > alpha.y ? 0.0 : 1.0; }

// [CG] eq. 5 for a fragment in shadow and eq. 6 for a lit one.
float shadowedVisibility(vec2 alpha) { return 1.0 - alpha.x - alpha.y < 0.5 ? 0.0 : 1.0; }
float litVisibility(vec2 alpha) { return alpha.x + alpha.y < 0.5 ? 0.0 : 1.0; }

// [CG] eq. 7: both in one. `s` is the shadow test.
float improvedVisibility(float s, vec2 alpha) {
  precise float v = (1.0 - s) + (2.0 * s - 1.0) * (alpha.x + alpha.y);
  return v < 0.5 ? 0.0 : 1.0;
}

// Improved RBSM, [CG] 3.2: both sides of an edge are revectorized. SILENT on U, O and I shapes, which keep the shadow
// test.
float improvedRBSM(vec3 p) {
  float s = shadowTest(p, texelOf(p));
  vec3 d = computeDiscontinuity(p, texelOf(p));
  if (!(d.r > 0.0 || d.g > 0.0)) return s;
  vec4 nrd = normalizeFragmentDistanceToSE(computeFragmentDistanceToSE(p, d));
  return nrd.z == 0.0 && nrd.w == 0.0 ? improvedVisibility(s, nrd.xy) : s;
}

// [CG] eq. 8: intensity of a fragment in the penumbra (D <= P / 2). `s` is its improved hard visibility, `D` the
// distance to the nearest seed and `P` the width of the penumbra, both in world units.
float penumbraIntensity(float s, float D, float P) {
  return s == 0.0 ? 0.5 - D / P : 0.5 + D / P;
}

// [CG] eq. 10: distance of a screen of height 1 from the eye, for the full vertical angle of view in radians.
float screenDistance(float fov_y) { return 1.0 / (2.0 * tan(0.5 * fov_y)); }

// [CG] eq. 9: width of the mean filter as a share of the screen's height, for a width in world units at the eye depth
// `z_eye`.
float screenFilterWidth(float w_filter, float z_screen, float z_eye) { return w_filter * z_screen / z_eye; }

#endif
