// What the search for the nearest edge in the world goes by: candidates, each a label of a seed, of which the nearest on the
// pixel's own surface counts.
#ifndef EDGESHADE_NEAREST_EDGE
#define EDGESHADE_NEAREST_EDGE
#include "edge_seeds.glsl"

// A label of the search stands for a block of pixels of this side, at the middle.
const int BLOCK = 4;

layout(binding = 3) uniform usampler2D seeds;

struct Nearest {
  float squared; // distance, world units
  uint label;    // x + 65536 y of the seed
};

// Nothing yet. What is out of reach is never anything, so that no label leaves the listed tiles.
Nearest nothingInReach() {
  float reach = penumbraReach();
  return Nearest(reach * reach * 1.000001, NO_SEED);
}

bool onSurface(Receiver p, float width, vec3 apart, uvec4 seed, ivec2 pixels) {
  if (!PLANES) return sameDepth(p.position.z, p.position.z + apart.z, push.tolerance);
  // Never less than half a pixel, where the edge passes the pixel itself.
  float between = max(length(vec2(pixels)), 0.5);
  return nearPlane(p.normal, apart, between, width, push.tolerance) &&
         nearPlane(seedNormal(seed), apart, between, width, push.tolerance);
}

// Takes the candidate if it is nearer, on the pixel's surface.
void consider(uint candidate, ivec2 pixel, Receiver p, float width, inout Nearest nearest) {
  ivec2 at = ivec2(candidate & 0xffffu, candidate >> 16);
  bool is_label = candidate != NO_SEED;
  uvec4 seed = texelFetch(seeds, is_label ? at : ivec2(0), 0);
  vec3 apart = seedPoint(seed) - p.position;
  float d2 = dot(apart, apart);
  bool nearer = is_label && d2 < nearest.squared && onSurface(p, width, apart, seed, at - pixel);
  nearest.squared = nearer ? d2 : nearest.squared;
  nearest.label = nearer ? candidate : nearest.label;
}

// Labels along both axes.
ivec2 blockCount() { return (ivec2(view.size) + BLOCK - 1) / BLOCK; }
ivec2 blockPixel(ivec2 block) { return min(BLOCK * block + BLOCK / 2, ivec2(view.size) - 1); }

#endif
