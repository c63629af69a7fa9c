#version 460
// Finds the seeds among the listed pixels: pixels that differ from a neighbour on the same surface. A seed's point lies
// half-way to those neighbours; edge_line.comp refines it. Marks all tiles that a penumbra around the seeds may reach.
// If seeds have penumbra widths of their own (SOFT), seed_width.comp marks the tiles instead.
// Macedo, Apolinario (2018), algorithm 1. The paper compares neighbours on any surface (ANY_SURFACE), and takes the
// centres of the pixels on both sides as the edge (AT_PIXELS), which leaves a plateau two pixels wide.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "edge_seeds.glsl"
#include "edge_marks.glsl"
#include "edge_pixels.glsl"

layout(constant_id = 1) const bool ANY_SURFACE = false;
layout(constant_id = 3) const bool SOFT = false;

layout(local_size_x = 64) in;

layout(binding = 4, scalar) readonly buffer PixelList {
  uint groups[3];
  uint count;
  uint pixels[];
} list;
layout(binding = 5, scalar) writeonly buffer Seeds { uvec3 seeds[]; };
layout(binding = 6, scalar) buffer SeedBits { uint seed_bits[]; }; // one word per column and 32 rows, bit y % 32

layout(binding = 8, scalar) buffer Coarse {
  uint coarse_groups[3][3];
  int farthest; // reach of the widest penumbra, pixels
};

bool isSurface(ivec2 pixel) {
  return all(greaterThanEqual(pixel, ivec2(0))) && all(lessThan(pixel, ivec2(view.size))) && depthAt(pixel) != view.far_depth;
}

bool onSameSurface(Receiver p, ivec2 pixel, Receiver q, ivec2 other) {
  if (!PLANES) return sameDepth(p.position.z, q.position.z, push.tolerance);
  vec3 apart = q.position - p.position;
  float pixels = length(vec2(other - pixel)), width = min(pixelWidth(p.position), pixelWidth(q.position));
  return !isRidge(p.normal, q.normal, apart) && nearPlane(p.normal, apart, pixels, width, push.tolerance) &&
         nearPlane(q.normal, apart, pixels, width, push.tolerance);
}

// Returns false if the pixel is not a seed.
bool findSeed(ivec2 pixel, out vec3 point, out vec3 normal, out float nearest_depth) {
  if (!isSurface(pixel)) return false;
  uint differing = edgeNeighbours(pixel);
  Receiver p = receiverAt(pixel);
  vec3 apart = vec3(0.0);
  int count = 0;
  while (differing != 0) {
    int i = findLSB(differing);
    differing &= differing - 1;
    ivec2 other = pixel + neighbour(i);
    if (!isSurface(other)) continue;
    Receiver q = receiverAt(other);
    if (!ANY_SURFACE && !onSameSurface(p, pixel, q, other)) continue;
    apart += q.position - p.position;
    ++count;
  }
  if (count == 0) return false;
  // The mean of the half-way points: on a straight edge it lies on the line through them.
  float half_way = AT_PIXELS ? 0.0 : 0.5 / float(count);
  point = p.position + half_way * apart;
  // Smallest eye depth the edge can have: the refined point lies at most twice the half-way distance away.
  nearest_depth = min(eyeDepth(p.position), eyeDepth(p.position + 2.0 * half_way * apart));
  normal = p.normal;
  return true;
}

void workOn(ivec2 pixel) {
  vec3 point, normal;
  float nearest_depth;
  if (!findSeed(pixel, point, normal, nearest_depth)) return;
  seeds[seedIndex(pixel)] = packSeed(pixel, Seed(point, normal, vec3(0.0)));
  atomicOr(seed_bits[pixel.x + view.size.x * (pixel.y / 32)], 1u << (pixel.y & 31));
  if (SOFT) return;
  // The filter reads half its width beyond the pixels that it changes.
  ivec2 first, last;
  int reach = tilesInReach(pixel, penumbraReach() + 0.5 * push.filter_width, nearest_depth, AROUND_LINE, first, last);
  if (reach > farthest) atomicMax(farthest, reach);
  mark(first, last);
}

void main() {
  uint threads = 64 * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < list.count; i += threads) workOn(unpackTile(list.pixels[i]));
}
