// The visibility of a point in the shadow map: most follow from the texel and its four neighbours, those at an edge from the
// edge's shape. The includer defines the two functions declared here.
#ifndef EDGESHADE_RBSM_VISIBILITY
#define EDGESHADE_RBSM_VISIBILITY
#include "common/rbsm_receiver.glsl"

// Whether the visibility follows from the neighbourhood alone; then it is `v`.
bool decideByNeighbourhood(ShadowPoint p, float s, vec3 d, out float v);
// The visibility of the others.
float revectorize(ShadowPoint p, vec3 d);

float workOut(ShadowPoint p) {
  vec4 N;
  float s = testNeighbourhood(p, N), v;
  vec3 d = packDiscontinuity(N, s);
  // Once more: nothing but `precise` makes two pipelines see the same texel.
  return decideByNeighbourhood(p, s, d, v) ? v : revectorize(p, d);
}

#endif
