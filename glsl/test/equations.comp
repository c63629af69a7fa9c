#version 460
// Evaluates equations 4 to 10 of lib/rbsm_listings.glsl. Sixteen columns of pixels belong to each equation; the pixel's
// place gives the arguments.
#extension GL_GOOGLE_include_directive : require
#include "lib/rbsm_listings.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 3, r32f) writeonly uniform image2D visibility;

// Required by the file of the listings; the equations do not call it.
float shadowTest(vec3 p, ivec2 texel) { return 1.0; }

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(visibility)))) return;
  vec2 alpha = vec2(pixel.x & 15, pixel.y & 15) / 16.0;
  float s = float(pixel.y >> 4 & 1), v = 0.0;
  switch (pixel.x >> 4) {
    case 0: v = originalVisibility(alpha); break;
    case 1: v = s == 0.0 ? shadowedVisibility(alpha) : litVisibility(alpha); break;
    case 2: v = improvedVisibility(s, alpha); break;
    case 3: v = penumbraIntensity(s, 0.5 * alpha.x, 1.0 + alpha.y); break;
    case 4: v = screenFilterWidth(alpha.x, 1.0 + s, 1.0 + alpha.y); break;
    case 5: v = screenDistance(0.1 + alpha.x + alpha.y); break;
  }
  imageStore(visibility, pixel, vec4(v));
}
