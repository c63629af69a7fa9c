#version 460
// Edge distance shadow mapping: between texels with different tests, the interpolated distance to the edge decides.
// Kenzel, "Edge Distance Shadow Mapping" (2013), section 3.3; soft borders by kernels as in section 6.1.
// Departures, unless FIXED and EIGHT_BITS: texels are tested on the receiver's plane, and the distance is interpolated
// in single precision instead of a sampler's 8 bits. In any form: four gathered tests take the place of the comparison
// sampler, which is asked only whether they agree; where no edge is known, the nearest texel decides: where receiver
// and occluder meet, or where the occluder's texture has holes (the paper does not say what its map holds there).
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "common/rbsm_receiver.glsl"
#include "edsm_border.glsl"

layout(constant_id = 1) const bool PICTURE = false; // draw the distances over the visibility
layout(constant_id = 2) const uint BORDER_BITS = 0; // half width of the border, texels, as the bits of a float; 0: hard
layout(constant_id = 3) const int KERNEL = BOX;
layout(constant_id = 4) const bool EIGHT_BITS = false; // interpolate in steps of 1/256 of a texel

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 4) writeonly uniform image2D visibility;
layout(binding = 5) uniform sampler2D distances;

// Texels without an edge, and those outside the map, hold 0.
float distanceOf(ivec2 texel) {
  bool inside = all(greaterThanEqual(texel, ivec2(0))) && all(lessThan(texel, ivec2(view.map_size)));
  return inside ? texelFetch(distances, texel, 0).x : 0.0;
}

float lit(ShadowPoint p, out float d) {
  bvec2 later = greaterThanEqual(p.fraction, vec2(0.5));
  vec2 q = p.fraction + mix(vec2(0.5), vec2(-0.5), later);
  ivec2 corner = p.texel + ivec2(later) - 1;
  uint tests = shadowTest2x2(p, corner);
  vec4 four;
  for (int i = 0; i < 4; ++i) four[i] = distanceOf(corner + ivec2(i & 1, i >> 1));
  float half_border = uintBitsToFloat(BORDER_BITS);
  bool none = four == vec4(0.0), uniform_tests = tests == 0u || tests == 15u;
  if (half_border > 0.0 && !none) {
    // A texel that no edge comes near lies beyond the border: on the side of its own test or, if all tests agree, on
    // the side of the other distances.
    float sum = four.x + four.y + four.z + four.w;
    for (int i = 0; i < 4; ++i) {
      bool outside = uniform_tests ? sum < 0.0 : (tests >> i & 1u) != 0u;
      if (four[i] == 0.0) four[i] = outside ? -half_border - 1.0 : half_border + 1.0;
    }
  }
  vec2 weight = EIGHT_BITS ? round(q * 256.0) / 256.0 : q;
  precise float upper = mix(four.x, four.y, weight.x), lower = mix(four.z, four.w, weight.x);
  precise float between = mix(upper, lower, weight.y);
  d = between;
  if (none) {
    uint nearest = (q.x >= 0.5 ? 1u : 0u) + (q.y >= 0.5 ? 2u : 0u);
    return float(tests >> nearest & 1u);
  }
  if (half_border == 0.0) return uniform_tests ? float(tests & 1u) : d > 0.0 ? 0.0 : 1.0;
  if (uniform_tests) {
    // If all tests agree, the edge need not be a shadow's: it may be the receiver's own, or lie within the shadow of
    // something else. Beyond the edge of a shadow, the test has the other result.
    precise vec2 inwards = vec2(mix(four.y - four.x, four.w - four.z, q.y), mix(four.z - four.x, four.w - four.y, q.x));
    float l = length(inwards);
    precise vec2 beyond = vec2(p.texel) + p.fraction - inwards / l * (d + (d > 0.0 ? 0.75 : -0.75));
    bool is_lit = (tests & 1u) != 0u;
    if (!(l > 0.0) || is_lit == (d > 0.0) || (shadowTest(p, ivec2(floor(beyond))) != 0.0) == is_lit) return float(tests & 1u);
  }
  return borderVisibility(d / half_border, KERNEL);
}

// Outside blue, inside red, paler with the distance; a dark line every half texel.
vec3 picture(float d, float v) {
  vec3 grey = mix(vec3(0.15), vec3(0.85), v);
  if (d == 0.0) return grey;
  vec3 color = mix(d > 0.0 ? vec3(0.85, 0.2, 0.15) : vec3(0.15, 0.35, 0.9), grey, min(abs(d) / 2.5, 0.8));
  float off = abs(fract(2.0 * abs(d) + 0.5) - 0.5);
  return color * (off < 0.08 ? 0.6 : 1.0);
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, ivec2(view.size)))) return;
  ShadowPoint p;
  float v, d = 0.0;
  if (!rbsmReceiver(pixel, p, v)) v = lit(p, d);
  imageStore(visibility, pixel, PICTURE ? vec4(picture(d, v), 1.0) : vec4(v));
}
