// Revectorization goes over the image in the steps of pixel_steps.glsl. The includer defines the two functions declared here.
#ifndef EDGESHADE_PIXEL_LIST
#define EDGESHADE_PIXEL_LIST
#include "common/rbsm_receiver.glsl"
#include "common/pixel_steps.glsl"

// Whether the visibility is found cheaply; then it is `v`.
bool decide(ShadowPoint p, out float v);
// The visibility of the others.
float workOut(ShadowPoint p);

// False if the pixel is left for later.
bool visibilityAt(ivec2 pixel, out float v) {
  ShadowPoint p;
  if (rbsmReceiver(pixel, p, v)) return true;
  if (STEP != LISTED && decide(p, v)) return true;
  if (STEP != LIST) v = workOut(p);
  return STEP != LIST;
}

#endif
