#version 460
// Silhouette recovery and filtering with a branch for every scenario: see lib/rbsm_branches.glsl.
#extension GL_GOOGLE_include_directive : require
layout(constant_id = 1) const int MAX_DISTANCE = 16;
#define MAXDIST MAX_DISTANCE
#include "edge_list.glsl"
#include "lib/rbsm_branches.glsl"

const int SILHOUETTE = 0, FILTERED = 1;
layout(constant_id = 2) const int FUNCTION = SILHOUETTE;

// No shape is known before the traversals.
bool decideByNeighbourhood(ShadowPoint p, float s, vec3 d, out float v) {
  v = s;
  return d.x == 0.0 && d.y == 0.0 || FUNCTION == SILHOUETTE && s == 0.0;
}

float revectorize(ShadowPoint p, vec3 d) { return revectorizeByScenario(p, d, FUNCTION == SILHOUETTE); }
