// What the search for the nearest edge in the world goes by: candidates, each a label of a seed, of which the nearest on the
// pixel's own surface counts.
#ifndef EDGESHADE_NEAREST_EDGE
#define EDGESHADE_NEAREST_EDGE
#include "edge_seeds.glsl"

// A label of the search stands for a block of pixels of this side, at the middle: first coarse, then finer.
const int BLOCK = 4, QUAD = 2;

layout(binding = 3) uniform usampler2D seeds;

struct Nearest {
  float squared; // distance, world units
  uint label;    // x + 65536 y of the seed
};

// Squared distances within which an edge counts.
float reachSquared() {
  float reach = penumbraReach();
  return reach * reach * 1.000001;
}

// For blocks the filter's reach on top: as far as tiles are listed for sure, so that no label leaves the listed tiles.
float blockReachSquared() {
  float reach = penumbraReach() + 0.5 * push.filter_width;
  return reach * reach * 1.000001;
}

// A seed out of reach will do to start from.
Nearest nothing() { return Nearest(3.0e38, NO_SEED); }

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

// The labels of pixels aside, past what stands in front: `distance` of them along both axes both ways, and `rings` - 1 times
// as many again, each time twice as far.
void considerAside(usampler2D labels, int distance, int rings, ivec2 pixel, Receiver p, float width, inout Nearest nearest) {
  for (int i = 0; i < 4 * rings; ++i) {
    int away = ((i & 1) == 0 ? -distance : distance) << (i >> 2);
    ivec2 at = pixel + ((i & 2) == 0 ? ivec2(away, 0) : ivec2(0, away)), inside = clamp(at, ivec2(0), ivec2(view.size) - 1);
    consider(at == inside ? texelFetch(labels, inside, 0).x : NO_SEED, pixel, p, width, nearest);
  }
}

// The seeds that are nearest in the image to places `step` pixels around the one found: along the edge.
void considerAround(usampler2D labels, int step, ivec2 pixel, Receiver p, float width, inout Nearest nearest) {
  bool found = nearest.label != NO_SEED;
  ivec2 seed = found ? ivec2(nearest.label & 0xffffu, nearest.label >> 16) : ivec2(0);
  for (int i = 0; i < 8; ++i) {
    // Around the middle one, which is known.
    int j = i + int(i > 3), row = int(j > 2) + int(j > 5);
    ivec2 at = seed + step * (ivec2(j - 3 * row, row) - 1);
    uint label = texelFetch(labels, clamp(at, ivec2(0), ivec2(view.size) - 1), 0).x;
    consider(found ? label : NO_SEED, pixel, p, width, nearest);
  }
}

// Labels along both axes.
ivec2 blockCount(int side) { return (ivec2(view.size) + side - 1) / side; }
ivec2 blockPixel(ivec2 block, int side) { return min(side * block + side / 2, ivec2(view.size) - 1); }

uint blockLabel(usampler2D block_labels, ivec2 block, int side) {
  ivec2 inside = clamp(block, ivec2(0), blockCount(side) - 1);
  uint label = texelFetch(block_labels, inside, 0).x;
  return block == inside ? label : NO_SEED;
}

#endif
