// Percentage-closer filtering: Reeves, Salesin, Cook, "Rendering Antialiased Shadows with Depth Maps" (1987).
// The kernel is a box of w x w texels convolved with the bilinear tent of the hard test. It reads (w+1)^2 texels with
// the weights 1-f, 1, ..., 1, f along each axis, so that it slides without steps. Every texel is tested at its own
// centre on the receiver's plane.
// Departures: the paper averages the tests of single texels against the point's own depth. That form is pcfNearest, over
// the kernel of pcfNearestKernel with a plane of slope 0. Its image steps from texel to texel.
#ifndef EDGESHADE_PCF
#define EDGESHADE_PCF
#include "lib/shadow_test.glsl"

// A kernel's place in the map, and the receiver's plane over it.
struct PcfKernel {
  ivec2 base;      // first of the (w+1)^2 texels
  vec2 f;          // offset of the kernel within a texel, 0 to 1
  float reference; // receiver depth at the centre of `base`, bias subtracted
  vec2 slope;      // change of the receiver's depth per texel
};

// `depth` has its bias subtracted.
PcfKernel pcfKernel(vec2 uv, float depth, vec2 plane, int w, vec2 map_size) {
  precise PcfKernel k;
  precise vec2 x = uv * map_size - 0.5;
  vec2 first = floor(x);
  k.f = x - first;
  k.base = ivec2(first) - (w - 1) / 2;
  k.slope = plane / map_size;
  // The last factor is the way from the point to the centre of `base`, in texels.
  k.reference = depth + dot(k.slope, vec2(k.base) - x);
  return k;
}

// The kernel of w x w texels around the one that the point falls into, for pcfNearest.
PcfKernel pcfNearestKernel(vec2 uv, float depth, vec2 plane, int w, vec2 map_size) {
  precise PcfKernel k;
  precise vec2 place = uv * map_size;
  k.f = vec2(0.0);
  k.base = ivec2(floor(place)) - (w - 1) / 2;
  k.slope = plane / map_size;
  k.reference = depth + dot(k.slope, vec2(k.base) + 0.5 - place);
  return k;
}

float pcfReference(PcfKernel k, int i, int j) {
  precise float reference = k.reference + (float(i) * k.slope.x + float(j) * k.slope.y);
  return reference;
}

// Weight of column (or row) i of w+1.
float pcfWeight(int i, float f, int w) { return i == 0 ? 1.0 - f : i == w ? f : 1.0; }

// Normalizes the sum; gives exactly 0 or 1 where all tests agree.
float pcfNormalize(float sum, int lit, int w) {
  int taps = (w + 1) * (w + 1);
  return lit == 0 ? 0.0 : lit == taps ? 1.0 : clamp(sum / float(w * w), 0.0, 1.0);
}

// Filters with one fetch per texel.
float pcfLoop(sampler2DArray shadow_map, PcfKernel k, int w, int layer, ivec2 map_size) {
  float sum = 0.0;
  int lit = 0;
  for (int j = 0; j <= w; ++j) {
    float row = 0.0;
    for (int i = 0; i <= w; ++i) {
      float s = shadowTest(pcfReference(k, i, j), shadowMapDepth(shadow_map, k.base + ivec2(i, j), layer, map_size));
      row += s * pcfWeight(i, k.f.x, w);
      lit += int(s);
    }
    sum += row * pcfWeight(j, k.f.y, w);
  }
  return pcfNormalize(sum, lit, w);
}

// The share of lit texels among the kernel's w x w.
float pcfNearest(sampler2DArray shadow_map, PcfKernel k, int w, int layer, ivec2 map_size) {
  float lit = 0.0;
  for (int j = 0; j < w; ++j) {
    for (int i = 0; i < w; ++i) {
      lit += shadowTest(pcfReference(k, i, j), shadowMapDepth(shadow_map, k.base + ivec2(i, j), layer, map_size));
    }
  }
  return lit / float(w * w);
}

// Filters with one gather per 2 x 2 texels. It samples their common corner, where rounding cannot select other texels.
// The sampler's border must be white.
float pcfGather(sampler2DArray shadow_map, PcfKernel k, int w, int layer, ivec2 map_size) {
  vec2 texel = 1.0 / vec2(map_size);
  float sum = 0.0;
  int lit = 0;
  for (int j = 0; j <= w; j += 2) {
    float upper = 0.0, lower = 0.0;
    for (int i = 0; i <= w; i += 2) {
      vec4 stored = textureGather(shadow_map, vec3(vec2(k.base + ivec2(i, j) + 1) * texel, float(layer)));
      // Gather order: (0, 1), (1, 1), (1, 0), (0, 0).
      vec4 s = vec4(shadowTest(pcfReference(k, i, j + 1), stored.x), shadowTest(pcfReference(k, i + 1, j + 1), stored.y),
                    shadowTest(pcfReference(k, i + 1, j), stored.z), shadowTest(pcfReference(k, i, j), stored.w));
      float left = pcfWeight(i, k.f.x, w), right = pcfWeight(i + 1, k.f.x, w);
      upper += s.w * left + s.z * right;
      lower += s.x * left + s.y * right;
      lit += int(s.x + s.y + s.z + s.w);
    }
    sum += upper * pcfWeight(j, k.f.y, w) + lower * pcfWeight(j + 1, k.f.y, w);
  }
  return pcfNormalize(sum, lit, w);
}

#endif
