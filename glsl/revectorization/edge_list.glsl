// A pass that decides most pixels by the texel that they fall into and its four neighbours, and leaves those at an edge to
// pixel_list.glsl.
#ifndef EDGESHADE_EDGE_LIST
#define EDGESHADE_EDGE_LIST
#include "pixel_list.glsl"
#include "rbsm_visibility.glsl"

bool decide(ShadowPoint p, out float v) {
  vec4 N;
  float s = testNeighbourhood(p, N);
  return decideByNeighbourhood(p, s, packDiscontinuity(N, s), v);
}

#endif
