// A pass that decides most pixels by the texel that they fall into and its four neighbours, and leaves those at an edge to
// pixel_list.glsl. The includer defines the two functions declared here.
#ifndef EDGESHADE_EDGE_LIST
#define EDGESHADE_EDGE_LIST
#include "pixel_list.glsl"

// Whether the visibility follows from the neighbourhood alone; then it is `v`.
bool decideByNeighbourhood(ShadowPoint p, float s, vec3 d, out float v);
// The visibility of the others.
float revectorize(ShadowPoint p, vec3 d);

bool decide(ShadowPoint p, out float v) {
  vec4 N;
  float s = testNeighbourhood(p, N);
  return decideByNeighbourhood(p, s, packDiscontinuity(N, s), v);
}

float workOut(ShadowPoint p) {
  vec4 N;
  float s = testNeighbourhood(p, N), v;
  vec3 d = packDiscontinuity(N, s);
  // Once more: nothing but `precise` makes two pipelines see the same texel.
  return decideByNeighbourhood(p, s, d, v) ? v : revectorize(p, d);
}

#endif
