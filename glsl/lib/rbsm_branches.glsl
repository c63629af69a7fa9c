// RBSM with one branch for every scenario, its form before [JCGT] replaced scenarios by shapes. Benchmarks compare
// lib/rbsm.glsl with it. The results are the same, bit for bit. Include like lib/rbsm.glsl.
//
// A scenario is the set of edge ends that the traversals found. For the L shape, the axis of the edge belongs to it
// too. In filtering, so does the fragment's own test, except for the I shape, which keeps the test.
//
//                        I   O   U    L
//   silhouette recovery  1   1   2    8   U: the axis; L: the end found on each axis, and the axis of the edge
//   filtering            1   2  12   16   O: the test; U: the axis, which end of the other, if any, and the test
//
// [JCGT] section 4 gives these counts, but no list. The distinction between scenarios is this file's interpretation.
// The paper states the counts, the results (listings 4 and 5), and that every fragment at an edge, short U and O
// included, is first traversed in all four directions.
#ifndef EDGESHADE_RBSM_BRANCHES
#define EDGESHADE_RBSM_BRANCHES
#include "lib/rbsm.glsl"

// Position along the edge, from 0 at the end that was found to 1 at the other: normalizeFragmentDistanceToSE for known
// signs.
float placeInEdge(float found, float other) {
  precise float place = found / (found - other);
  return place;
}

// Listing 4. `rd` is the result of computeFragmentDistanceToSE. A side that differs counts as an end that was found.
float recoverSilhouetteByScenario(vec3 d, vec4 rd) {
  bvec4 side = discontinuitySides(d);
  bvec4 end = greaterThan(rd, vec4(0.0));
  bool left = end.x, right = end.y, plus = end.z, minus = end.w;
  float l = rd.x, r = rd.y, p = rd.z, m = rd.w;
  // O.
  if (left && right && plus && minus) return 0.0;
  // U.
  if (left && right) return 0.0;
  if (plus && minus) return 0.0;
  // L along u: on the side +v, then -v.
  if (side.z && left) return step(1.0 - placeInEdge(l, r), placeInEdge(p, m));
  if (side.z && right) return step(1.0 - placeInEdge(r, l), placeInEdge(p, m));
  if (side.w && left) return step(1.0 - placeInEdge(l, r), placeInEdge(m, p));
  if (side.w && right) return step(1.0 - placeInEdge(r, l), placeInEdge(m, p));
  // L along v: on the left side, then on the right.
  if (side.x && plus) return step(1.0 - placeInEdge(l, r), placeInEdge(p, m));
  if (side.x && minus) return step(1.0 - placeInEdge(l, r), placeInEdge(m, p));
  if (side.y && plus) return step(1.0 - placeInEdge(r, l), placeInEdge(p, m));
  if (side.y && minus) return step(1.0 - placeInEdge(r, l), placeInEdge(m, p));
  // I.
  return 1.0;
}

// Listing 5. Results are clamped where a formula can leave the range.
float filterSilhouetteByScenario(vec3 d, vec4 rd) {
  bvec4 side = discontinuitySides(d);
  bvec4 end = greaterThan(rd, vec4(0.0));
  bool left = end.x, right = end.y, plus = end.z, minus = end.w;
  float l = rd.x, r = rd.y, p = rd.z, m = rd.w;
  bool lit = d.z == 0.0;
  precise float v;
  // O.
  if (lit && left && right && plus && minus) v = 0.0;
  else if (!lit && left && right && plus && minus) v = 1.0;
  // U between left and right: closed on the side +v, on -v, or a bar.
  else if (lit && left && right && plus) v = placeInEdge(p, m);
  else if (lit && left && right && minus) v = placeInEdge(m, p);
  else if (lit && left && right) v = 0.0;
  else if (!lit && left && right && plus) v = 1.0 - placeInEdge(p, m);
  else if (!lit && left && right && minus) v = 1.0 - placeInEdge(m, p);
  else if (!lit && left && right) v = 1.0;
  // U between +v and -v: closed on the left, on the right, or a bar.
  else if (lit && plus && minus && left) v = placeInEdge(l, r);
  else if (lit && plus && minus && right) v = placeInEdge(r, l);
  else if (lit && plus && minus) v = 0.0;
  else if (!lit && plus && minus && left) v = 1.0 - placeInEdge(l, r);
  else if (!lit && plus && minus && right) v = 1.0 - placeInEdge(r, l);
  else if (!lit && plus && minus) v = 1.0;
  // L of a lit fragment: along u, then along v.
  else if (lit && side.z && left) v = min(placeInEdge(p, m) + placeInEdge(l, r), 1.0);
  else if (lit && side.z && right) v = min(placeInEdge(p, m) + placeInEdge(r, l), 1.0);
  else if (lit && side.w && left) v = min(placeInEdge(m, p) + placeInEdge(l, r), 1.0);
  else if (lit && side.w && right) v = min(placeInEdge(m, p) + placeInEdge(r, l), 1.0);
  else if (lit && side.x && plus) v = min(placeInEdge(p, m) + placeInEdge(l, r), 1.0);
  else if (lit && side.x && minus) v = min(placeInEdge(m, p) + placeInEdge(l, r), 1.0);
  else if (lit && side.y && plus) v = min(placeInEdge(p, m) + placeInEdge(r, l), 1.0);
  else if (lit && side.y && minus) v = min(placeInEdge(m, p) + placeInEdge(r, l), 1.0);
  // L of a shadowed fragment.
  else if (!lit && side.z && left) v = max(1.0 - placeInEdge(p, m) - placeInEdge(l, r), 0.0);
  else if (!lit && side.z && right) v = max(1.0 - placeInEdge(p, m) - placeInEdge(r, l), 0.0);
  else if (!lit && side.w && left) v = max(1.0 - placeInEdge(m, p) - placeInEdge(l, r), 0.0);
  else if (!lit && side.w && right) v = max(1.0 - placeInEdge(m, p) - placeInEdge(r, l), 0.0);
  else if (!lit && side.x && plus) v = max(1.0 - placeInEdge(p, m) - placeInEdge(l, r), 0.0);
  else if (!lit && side.x && minus) v = max(1.0 - placeInEdge(m, p) - placeInEdge(l, r), 0.0);
  else if (!lit && side.y && plus) v = max(1.0 - placeInEdge(p, m) - placeInEdge(r, l), 0.0);
  else if (!lit && side.y && minus) v = max(1.0 - placeInEdge(m, p) - placeInEdge(r, l), 0.0);
  // I.
  else v = 1.0 - d.z;
  return v;
}

// Counterpart of revectorizeShadowEdge.
float revectorizeByScenario(ShadowPoint p, vec3 d, bool silhouette_recovery) {
  vec4 rd = computeFragmentDistanceToSE(p, d);
  return silhouette_recovery ? recoverSilhouetteByScenario(d, rd) : filterSilhouetteByScenario(d, rd);
}

#endif
