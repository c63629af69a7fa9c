// Revectorized visibility of a point in the shadow map by one of four functions: silhouette recovery, filtering, RBSM*
// and the edge profile; see lib/rbsm*.glsl. Most points follow from the texel and its four neighbours
// (decideByNeighbourhood), those at an edge from the edge's shape (revectorize).
// Include after lib/rbsm_profile.glsl and lib/rbsm_star.glsl.
#ifndef EDGESHADE_RBSM_FUNCTION
#define EDGESHADE_RBSM_FUNCTION

const int SILHOUETTE = 0, FILTERED = 1, STAR = 2, PROFILE = 3;
layout(constant_id = 2) const int FUNCTION = SILHOUETTE;
layout(constant_id = 3) const int QUALITY = 0; // of the edge profile: run, neighbours, line

bool decideByNeighbourhood(ShadowPoint p, float s, vec3 d, out float v) {
  v = s;
  if (d.x == 0.0 && d.y == 0.0) return true;
  switch (FUNCTION) {
    case SILHOUETTE:
      if (s == 0.0) return true;
      v = 0.0;
      return d.x == 0.75 || d.y == 0.75;
    case FILTERED:
      v = d.z;
      return d.x == 0.75 && d.y == 0.75;
    case STAR:
      return d.x == 0.75 || d.y == 0.75;
    default:
      return !any(sidesInReach(p, d, QUALITY));
  }
}

float revectorize(ShadowPoint p, vec3 d) {
  switch (FUNCTION) {
    case SILHOUETTE:
    case FILTERED:
      return revectorizeShadowEdge(p, d, FUNCTION == SILHOUETTE);
    case STAR:
      return revectorizeStar(p, d);
    default:
      return revectorizeProfile(p, d, QUALITY);
  }
}

#endif
