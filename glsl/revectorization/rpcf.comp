#version 460
// Percentage-closer filtering of revectorized visibility; see lib/rpcf.glsl. A pixel whose kernel and ring lie on one
// side of the shadow is decided by their tests, or without tests by the depth bounds of the map's blocks.
#extension GL_GOOGLE_include_directive : require
layout(constant_id = 1) const int MAX_DISTANCE = 16;
#define MAXDIST MAX_DISTANCE
layout(constant_id = 2) const int WIDTH = 7; // odd
#define RPCF_WIDTH WIDTH
#define WINDOW_MOST WIDTH
#include "common/receiver.glsl"
#include "common/rbsm_receiver.glsl"
#include "lib/rbsm_profile.glsl"
#include "lib/rbsm_star.glsl"
#include "lib/texel_window.glsl"
#include "lib/rpcf.glsl"
#include "lib/pcf.glsl"
#include "common/pcf_bounds.glsl"
#include "common/pixel_steps.glsl"

layout(constant_id = 3) const int FUNCTION = 0; // as rpcfMean numbers them
layout(constant_id = 5) const bool BOUNDED = false;

layout(binding = 6) uniform sampler2D blocks; // depth_bounds.comp; read only if BOUNDED

// Tests whether all texels of the kernel and its ring agree, and those of one more row and column, which make the size
// even.
bool isUniform(ShadowPoint p, out float v) {
  ivec2 first = p.texel - WIDTH / 2 - 1;
  uint all_ones = 15u, any_ones = 0u;
  for (int j = 0; j < WIDTH + 2; j += 2) {
    for (int i = 0; i < WIDTH + 2; i += 2) {
      uint tests = shadowTest2x2(p, first + ivec2(i, j));
      all_ones &= tests;
      any_ones |= tests;
    }
  }
  v = any_ones == 0u ? 0.0 : 1.0;
  return any_ones == 0u || all_ones == 15u;
}

// Stores the tests of the kernel and its ring.
void testKernel(ShadowPoint p) {
  ivec2 first = p.texel - WIDTH / 2 - 1;
  clearWindow();
  [[dont_unroll]] for (int j = 0; j < WIDTH + 2; j += 2) {
    // Bit i is the ring's column i. Column 32, the last one of the widest kernel's ring, is kept apart.
    uint upper = 0u, lower = 0u, last = 0u;
    [[dont_unroll]] for (int i = 0; i < WIDTH + 2; i += 2) {
      uint tests = shadowTest2x2(p, first + ivec2(i, j));
      upper |= i < 32 ? (tests & 3u) << i : 0u;
      lower |= i < 32 ? tests >> 2 << i : 0u;
      last = tests;
    }
    // The ring's last column is the left one of its two texels, because the width with the ring is odd.
    setWindowRow(j - 1, ivec2(WIDTH), upper >> 1 & lineBits(WIDTH), bitAt(upper, 0), bitAt(last, 0));
    setWindowRow(j, ivec2(WIDTH), lower >> 1 & lineBits(WIDTH), bitAt(lower, 0), bitAt(last, 2));
  }
}

bool decide(ShadowPoint p, out float v) {
  if (BOUNDED) {
    // The kernel with its ring, as a PCF kernel that is one texel narrower.
    ivec2 first = p.texel - WIDTH / 2 - 1;
    PcfKernel kernel = PcfKernel(first, vec2(0.0), p.z + dot(vec2(first - p.texel), p.dz), p.dz);
    int decision = decideKernel(blocks, kernel, float(WIDTH + 1) * p.slack, WIDTH + 1, ivec2(view.map_size));
    v = float(decision);
    if (decision != UNDECIDED) return true;
  }
  return isUniform(p, v);
}

float workOut(ShadowPoint p) {
  testKernel(p);
  return rpcfMean(p, FUNCTION);
}

// Finds the visibility of a pixel. Returns false if the pixel is left for the dispatch over the list.
bool visibilityAt(ivec2 pixel, out float v) {
  ShadowPoint p;
  if (rbsmReceiver(pixel, p, v)) return true;
  if (STEP != LISTED && decide(p, v)) return true;
  if (STEP == LIST) return false;
  v = workOut(p);
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
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  bool inside = all(lessThan(pixel, ivec2(view.size)));
  bool decided = inside && visibilityAt(pixel, v);
  if (decided) imageStore(visibility, pixel, vec4(v));
  listPixel(pixel, inside && !decided);
}
