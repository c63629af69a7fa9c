#version 460
// Colours silhouette edges by their kind: bright where the camera sees them, dim behind surfaces.
#extension GL_GOOGLE_include_directive : require
#include "casters.glsl"
#include "silhouette.glsl"

layout(binding = 3) uniform sampler2D camera_depth;

layout(location = 0) flat in uint flags;
layout(location = 0) out vec4 color;

// A fold between two faces; the rim of an open surface; an edge that is no outline but counts for shadow volumes.
const vec3 FOLD = vec3(1.0, 0.8, 0.0), RIM = vec3(0.0, 0.8, 1.0), COUNTED = vec3(1.0, 0.2, 1.0);
const float DIM = 0.4;
// Rounding error of the matrix products, as a share of the distance from the far plane's depth.
const float ROUNDING = 1e-5;

// Change of depth to the next pixel of the same surface: the smaller of both steps, or the only one.
float slopeAlong(ivec2 pixel, ivec2 axis, float z) {
  ivec2 last = textureSize(camera_depth, 0) - 1;
  float least = 1.0;
  for (int side = -1; side <= 1; side += 2) {
    ivec2 p = pixel + side * axis;
    if (p == clamp(p, ivec2(0), last)) least = min(least, abs(texelFetch(camera_depth, p, 0).x - z));
  }
  return least;
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float z = texelFetch(camera_depth, pixel, 0).x;
  // The line passes within half a pixel of the pixel's centre. The tolerance is twice that, for surfaces that are not
  // flat.
  float slope = slopeAlong(pixel, ivec2(1, 0), z) + slopeAlong(pixel, ivec2(0, 1), z);
  float tolerance = slope + push.depth_error + ROUNDING * abs(gl_FragCoord.z - push.far_depth);
  float behind = push.far_depth == 0.0 ? z - gl_FragCoord.z : gl_FragCoord.z - z;
  bool seen = behind <= tolerance;
  if (seen != (push.seen != 0)) discard;
  vec3 kind = (flags & SILHOUETTE_OUTLINE) == 0 ? COUNTED : (flags & SILHOUETTE_BOUNDARY) != 0 ? RIM : FOLD;
  color = vec4(seen ? kind : DIM * kind, 1.0);
}
