#version 460
// Revectorized visibility by one of five functions; see rbsm_function.glsl.
#extension GL_GOOGLE_include_directive : require
layout(constant_id = 1) const int MAX_DISTANCE = 16;
#define MAXDIST MAX_DISTANCE
#include "common/receiver.glsl"
#include "common/rbsm_receiver.glsl"
#include "lib/rbsm_profile.glsl"
#include "lib/rbsm_star.glsl"
#include "rbsm_function.glsl"
#include "common/pixel_steps.glsl"
#include "common/soft_receiver.glsl"
#include "lib/pcf.glsl"
#include "common/pcf_bounds.glsl"
#include "common/hsm.glsl"
#include "common/quad_classes.glsl"
#include "common/tile_classes.glsl"
#include "rbsm_steps.glsl"

layout(constant_id = 5) const float FILTER_WIDTH = 0.0; // of the edge profile, texels; 0: hard

// Finds the visibility of a pixel. Returns false if the pixel is left for the dispatch over the list.
bool visibilityAt(ivec2 pixel, out float v) {
  ShadowPoint p;
  if (rbsmReceiver(pixel, p, v)) return true;
  vec4 N;
  float s = testNeighbourhood(p, N);
  vec3 d = packDiscontinuity(N, s);
  if (decideByNeighbourhood(p, s, d, FILTER_WIDTH, v)) return true;
  if (STEP == LIST) return false;
  v = revectorize(p, d, FILTER_WIDTH);
  return true;
}

void main() {
  float v;
  if (readsList()) {
    for (uint i = firstListed(); i < list.count; i += listStride()) {
      ivec2 pixel = unpackTile(list.pixels[i]);
      visibilityAt(pixel, v);
      imageStore(visibility, pixel, vec4(v));
    }
    return;
  }
  if (STEP == TILES) {
    decideTile();
    return;
  }
  ivec2 first = firstPixel();
  [[unroll]] for (int i = 0; i < PIXELS; ++i) {
    ivec2 pixel = quadPixel(first, i);
    bool inside = all(lessThan(pixel, ivec2(view.size)));
    bool decided = inside && visibilityAt(pixel, v);
    if (decided) imageStore(visibility, pixel, vec4(v));
    listLeft(pixel, inside && !decided);
  }
}
