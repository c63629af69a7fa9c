#version 460
// Moves the seeds' points from half-way between lit and shadowed pixels to the end of the hard shadow, found by
// bisection. The trial points lie on the pixel's plane; their visibility comes from the function of the hard shadows.
// Penumbrae therefore move smoothly with the shadow instead of by whole pixels.
// Macedo, Apolinario (2018) do not have this step; their edges are pixels.
#extension GL_GOOGLE_include_directive : require
layout(constant_id = 1) const int MAX_DISTANCE = 16;
#define MAXDIST MAX_DISTANCE
#include "common/receiver.glsl"
#include "common/rbsm_receiver.glsl"
#include "lib/rbsm_profile.glsl"
#include "lib/rbsm_star.glsl"
#include "revectorization/rbsm_function.glsl"
#include "seed_format.glsl"
#include "common/tiles.glsl"

layout(constant_id = 4) const int STEPS = 3;

layout(local_size_x = 64) in;

layout(binding = 4, scalar) readonly buffer PixelList {
  uint groups[3];
  uint count;
  uint pixels[];
} list;
layout(binding = 5, rgba32ui) uniform uimage2D seeds;
layout(binding = 6, scalar) readonly buffer SeedBits { uint seed_bits[]; }; // one word per column and 32 rows, bit y % 32

float hardVisibility(Receiver r) {
  ShadowPoint p;
  float v;
  if (rbsmReceiver(r, p, v)) return v;
  vec4 N;
  float s = testNeighbourhood(p, N);
  vec3 d = packDiscontinuity(N, s);
  return decideByNeighbourhood(p, s, d, 0.0, v) ? v : revectorize(p, d, 0.0);
}

void workOn(ivec2 pixel) {
  if ((seed_bits[pixel.x + view.size.x * (pixel.y / 32)] >> (pixel.y & 31) & 1u) == 0) return;
  Receiver r = receiverAt(pixel);
  uvec4 seed = imageLoad(seeds, pixel);
  vec3 start = r.position, across = 2.0 * (seedPoint(seed) - start);
  float lit = 0.0, dark = 2.0;
  // The far end is tried first: it may be lit too, around corners of the shadow and where the surface ends.
  for (int i = 0; i <= STEPS; ++i) {
    float middle = 0.5 * (lit + dark);
    r.position = start + middle * across;
    bool is_lit = hardVisibility(r) > 0.5;
    lit = is_lit ? middle : lit;
    dark = is_lit ? dark : middle;
  }
  if (dark > 1.0) return;
  imageStore(seeds, pixel, packSeed(start + 0.5 * (lit + dark) * across, r.normal));
}

void main() {
  uint threads = 64 * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < list.count; i += threads) workOn(unpackTile(list.pixels[i]));
}
