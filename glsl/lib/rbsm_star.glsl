// Improved revectorization, RBSM*: [CG] Macedo, Apolinario, "Improved anti-aliasing for Euclidean distance transform
// shadow mapping", eq. 5 to 7. Include like lib/rbsm.glsl.
//
// A straight line cuts a step of length L: it runs from half a texel up at one end, through the edge in mid-run, to
// half a texel down at the other end, so that neighbouring steps meet. Each side measures from the corner where its own
// run meets the other visibility. The paper is silent on U, O and I shapes; they keep the shadow test.
#ifndef EDGESHADE_RBSM_STAR
#define EDGESHADE_RBSM_STAR
#include "lib/rbsm.glsl"

// Eq. 7 before its threshold, for a fragment at an edge, on either side: the ramp of listing 5 across L shapes. U, O
// and I shapes keep the shadow test; listing 5 makes bars and gaps of one texel's width vanish.
float computeRBSMStarRamp(vec3 d, vec4 nrd) {
  float s = 1.0 - d.z;
  if (nrd.z != 0.0 || nrd.w != 0.0) return s;
  precise float v = d.z + (2.0 * s - 1.0) * (nrd.x + nrd.y);
  return clamp(v, 0.0, 1.0);
}

// Eq. 7.
float computeRBSMStarVisibility(vec3 d, vec4 nrd) { return computeRBSMStarRamp(d, nrd) < 0.5 ? 0.0 : 1.0; }

float revectorizeRamp(ShadowPoint p, vec3 d) {
  return computeRBSMStarRamp(d, normalizeFragmentDistanceToSE(computeFragmentDistanceToSE(p, d)));
}

float revectorizeStar(ShadowPoint p, vec3 d) { return revectorizeRamp(p, d) < 0.5 ? 0.0 : 1.0; }

float RBSMStar(ShadowPoint p) {
  float s = shadowTest(p, p.texel);
  vec3 d = computeDiscontinuity(p, s);
  return d.x > 0.0 || d.y > 0.0 ? revectorizeStar(p, d) : s;
}

#endif
