// Revectorized visibility of a point in the shadow map by one of five functions: silhouette recovery, the ramp, RBSM*,
// the edge profile, and filtering as printed; see lib/rbsm*.glsl. Most points follow from the texel and its four neighbours
// (decideByNeighbourhood), those at an edge from the edge's shape (revectorize).
// Include after lib/rbsm_profile.glsl and lib/rbsm_star.glsl.
#ifndef EDGESHADE_RBSM_FUNCTION
#define EDGESHADE_RBSM_FUNCTION

const int SILHOUETTE = 0, RAMP = 1, STAR = 2, PROFILE = 3, PRINTED = 4;
layout(constant_id = 2) const int FUNCTION = SILHOUETTE;
layout(constant_id = 3) const int QUALITY = 0; // of the edge profile: run, neighbours, line

// `filter_width` is that of the edge profile's ramp in texels, 0 for a hard edge.
bool decideByNeighbourhood(ShadowPoint p, float s, vec3 d, float filter_width, out float v) {
  v = s;
  if (d.x == 0.0 && d.y == 0.0) return true;
  switch (FUNCTION) {
    case SILHOUETTE:
      if (s == 0.0) return true;
      v = 0.0;
      return d.x == 0.75 || d.y == 0.75;
    case PRINTED:
      v = d.z;
      return d.x == 0.75 && d.y == 0.75;
    case RAMP:
    case STAR:
      return d.x == 0.75 || d.y == 0.75;
    default:
      return filter_width == 0.0 && !any(sidesInReach(p, d, QUALITY));
  }
}

float revectorize(ShadowPoint p, vec3 d, float filter_width) {
  switch (FUNCTION) {
    case SILHOUETTE:
    case PRINTED:
      return revectorizeShadowEdge(p, d, FUNCTION == SILHOUETTE);
    case RAMP:
      return revectorizeRamp(p, d);
    case STAR:
      return revectorizeStar(p, d);
    default:
      return filter_width > 0.0 ? filterProfile(p, d, QUALITY, filter_width) : revectorizeProfile(p, d, QUALITY);
  }
}

#endif
