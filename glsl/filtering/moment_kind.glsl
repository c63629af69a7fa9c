// The moments that a technique keeps of each texel.
// Include after lib/moments.glsl.
#ifndef EDGESHADE_MOMENT_KIND
#define EDGESHADE_MOMENT_KIND

const int VARIANCE = 0, WARPED = 1, PACKED = 2, POWERS = 3;
layout(constant_id = 0) const int KIND = VARIANCE;

// VARIANCE: x and x^2. WARPED: two warps of x, each with its square. PACKED: four moments in a basis for
// integers, see lib/moments.glsl. POWERS: x, x^2, x^3 and x^4, of which floats keep more where x is small.
vec4 momentsOf(float depth, float range, vec2 exponents) {
  float x = signedDepth(depth, range);
  if (KIND == VARIANCE) return vec4(x, x * x, 0.0, 0.0);
  if (KIND == PACKED) return packedMoments(x);
  if (KIND == POWERS) return vec4(x, x * x, x * x * x, x * x * x * x);
  vec2 w = warpDepth(x, exponents);
  return vec4(w.x, w.x * w.x, w.y, w.y * w.y);
}

#endif
