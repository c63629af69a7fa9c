#version 460
// Finds the nearest edge of every pixel of the listed tiles and turns its distance into an intensity; lists the tiles
// to filter. Macedo, Apolinario (2018), algorithm 1 and eq. 8.
// The paper takes the seed that is nearest in the image, and then its world distance (WORLD = false). That distance is
// too large on tilted receivers, and the penumbra is lost where the seed lies on another surface.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "edge_seeds.glsl"
#include "nearest_edge.glsl"
#include "beyond_edge.glsl"

layout(constant_id = 1) const bool WORLD = true;
layout(constant_id = 2) const bool VIEWED = false; // write seeds, labels and distances as well
layout(constant_id = 6) const int LINE_TAPS = 0;   // if SOFT: taps across the penumbra, see beyond_edge.glsl
layout(constant_id = 7) const bool FILTERED = true; // write intensities for a filter; false: write the visibility

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 4) uniform usampler2D labels;       // of the distance transform
layout(binding = 5) uniform usampler2D quad_labels; // of nearest_quad.comp
layout(binding = 6, scalar) readonly buffer TileList {
  uint groups[3];
  uint count;
  uint tiles[];
} list;
layout(binding = 8) writeonly uniform image2D intensity;
layout(binding = 9, scalar) buffer FilterList {
  uint groups[3];
  uint count;
  uint tiles[];
} filter_list;
layout(binding = 10) writeonly uniform image2D distances;
layout(binding = 11) writeonly uniform uimage2D nearest_labels;
layout(binding = 12) writeonly uniform image2D seed_mask; // 1 at a seed; the value of `widths` if SOFT
layout(binding = 14) writeonly uniform image2D pixel_widths; // if SOFT: full penumbra width at pixels in reach, world units
layout(binding = 15) writeonly uniform image2D visibility;   // unless FILTERED; may be `hard`, of which a pixel reads its own

shared bool wanted;

// Considers the pixel's own label, the labels aside, those of the quads around, and then the seeds next to the one
// found.
Nearest search(Place at) {
  ivec2 pixel = at.pixel;
  Nearest nearest = nothing();
  consider(texelFetch(labels, pixel, 0).x, at, nearest);
  if (!WORLD) return nearest;
  considerAside(labels, pixelsAside(at.width), 1, at, nearest);
  // The pixel's own quad and the three on the pixel's side of it.
  ivec2 quad = pixel / QUAD, side = 2 * (pixel & 1) - 1;
  for (int i = 0; i < 4; ++i) {
    consider(blockLabel(quad_labels, quad + side * ivec2(i & 1, i >> 1), QUAD), at, nearest);
  }
  for (int step = 2; step > 0; --step) considerAround(labels, step, at, nearest);
  return nearest;
}

// Largest number of searches for a pixel. If a crease lies on the way to the edge found, the search is repeated for
// edges that are farther. Checking the way to every candidate instead would take twice the time.
const int ROUNDS = 4;

Nearest findNearest(ivec2 pixel, Receiver p) {
  Place at = placeAt(pixel, p);
  Nearest nearest = nothing();
  bool open = p.surface;
  for (int round = 0; open && round < ROUNDS; ++round) {
    nearest = search(at);
    open = !bendsEvenly(at, nearest);
    at.beyond = nearest.squared;
    if (open) nearest = nothing();
  }
  return nearest;
}

void workOn(ivec2 tile) {
  ivec2 pixel = tile * TILE + ivec2(gl_LocalInvocationID.xy);
  if (gl_LocalInvocationIndex == 0) wanted = false;
  bool inside = all(lessThan(pixel, ivec2(view.size)));
  Receiver p;
  p.surface = false;
  p.position = vec3(0.0);
  p.normal = vec3(0.0, 0.0, 1.0);
  if (inside) p = receiverAt(pixel);
  Nearest nearest = findNearest(pixel, p);
  barrier();
  if (inside) {
    float squared = squaredShare(nearest);
    bool near = squared <= reachSquared(widthAt(nearest.label));
    float own = texelFetch(hard, pixel, 0).x, D = sqrt(squared);
    // A pixel out of reach keeps its hard shadow and is not filtered. Its intensity is lowered by 2 as a mark.
    float v = near ? penumbraIntensity(own, D, push.penumbra) : own - 2.0;
    if (SOFT && LINE_TAPS > 0) {
      bool wanted_line = near && D > 0.0;
      ivec2 seed = wanted_line ? ivec2(nearest.label & 0xffffu, nearest.label >> 16) : ivec2(0);
      vec3 apart = seedPoint(seed, seedAt(seed)) - p.position;
      float beyond = beyondEdge(pixel, p, apart, D, own, wanted_line ? LINE_TAPS : 0);
      if (wanted_line) v = clamp(v + beyond, 0.0, 1.0);
    }
    if (FILTERED || VIEWED) imageStore(intensity, pixel, vec4(v, packNormal(p.normal), 0.0, 0.0));
    if (!FILTERED && near) imageStore(visibility, pixel, vec4(v));
    if (near) wanted = true;
    if (SOFT) {
      vec2 width = texelFetch(widths, near ? ivec2(nearest.label & 0xffffu, nearest.label >> 16) : ivec2(0), 0).xy;
      if (near || VIEWED) imageStore(pixel_widths, pixel, vec4(near ? width.x : 0.0));
    }
    if (VIEWED) {
      imageStore(distances, pixel, vec4(near ? D : uintBitsToFloat(0x7f800000u)));
      // The distance transform labels a seed with itself.
      bool is_seed = texelFetch(labels, pixel, 0).x == (uint(pixel.x) | uint(pixel.y) << 16);
      vec4 seen = SOFT ? vec4(texelFetch(widths, pixel, 0).xy, 0.0, 0.0) : vec4(1.0);
      imageStore(seed_mask, pixel, is_seed ? seen : vec4(0.0));
      imageStore(nearest_labels, pixel, uvec4(near ? nearest.label : NO_SEED));
    }
  }
  barrier();
  if (FILTERED && gl_LocalInvocationIndex == 0 && wanted) {
    uint i = atomicAdd(filter_list.count, 1);
    filter_list.tiles[i] = packTile(uvec2(tile));
    if (i < MAX_TILE_GROUPS) atomicMax(filter_list.groups[0], i + 1);
  }
  barrier();
}

void main() {
  for (uint i = gl_WorkGroupID.x; i < list.count; i += gl_NumWorkGroups.x) workOn(unpackTile(list.tiles[i]));
}
