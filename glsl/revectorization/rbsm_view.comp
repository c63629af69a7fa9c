#version 460
// Pictures of the RBSM family's intermediate results. The channels of the last three pictures are in the order of
// listing 2: left, right, +v, -v; 0 where there is no edge.
#extension GL_GOOGLE_include_directive : require
layout(constant_id = 1) const int MAX_DISTANCE = 16;
#define MAXDIST MAX_DISTANCE
#include "common/receiver.glsl"
#include "common/rbsm_receiver.glsl"
#include "lib/rbsm_profile.glsl"

layout(constant_id = 2) const int QUALITY = 0; // of the edge profile: run, neighbours, line

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 4) writeonly uniform image2D discontinuity; // packed form of listing 2
layout(binding = 5) writeonly uniform image2D runs;          // length of the runs of listing 3, texels
layout(binding = 6) writeonly uniform image2D ends;          // 1: at an edge end; -1: stepped out, or MAXDIST reached
layout(binding = 7) writeonly uniform image2D height;        // height of the edge profile over each side, texels

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, ivec2(view.size)))) return;
  ShadowPoint p;
  float decided;
  vec3 d = vec3(0.0);
  vec4 t = vec4(0.0), h = vec4(0.0);
  if (rbsmReceiver(pixel, p, decided)) {
    d.z = 1.0 - decided;
  } else {
    vec4 N;
    float s = testNeighbourhood(p, N);
    d = packDiscontinuity(N, s);
    bvec4 sides = discontinuitySides(d);
    for (int k = 0; k < 4 && any(sides); ++k) {
      t[k] = traverseShadowSilhouette(p, d, SIDES[k]);
      float place = k < 2 ? p.fraction.y : p.fraction.x;
      if (sides[k]) h[k] = profileHeight(edgeProfile(p, s, SIDES[k], QUALITY), place);
    }
  }
  imageStore(discontinuity, pixel, vec4(d, 1.0));
  imageStore(runs, pixel, abs(t));
  imageStore(ends, pixel, sign(t));
  imageStore(height, pixel, h);
}
