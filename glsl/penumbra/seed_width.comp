#version 460
// Finds the penumbra width at every seed by a blocker search there alone, and marks the tiles that the penumbra may
// reach: Macedo, Apolinario (2017), algorithm 1, with the formulas of percentage-closer soft shadows.
//
// Departures: see common/blockers.glsl for those of the search. The width is that on a receiver parallel to the map.
// The paper measures distances along the surface as if every receiver were parallel. ALONG_LIGHT measures them on such
// a plane instead, along the light's rays, and by the shape of the light (see nearest_edge.glsl). So a penumbra on a
// tilted receiver gets its proper length.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "common/soft_receiver.glsl"
#include "common/blockers.glsl"
#include "edge_seeds.glsl"
#include "edge_marks.glsl"
#include "lib/pcf.glsl"
#include "common/pcf_bounds.glsl"
#include "common/hsm.glsl"

layout(constant_id = 1) const int SEARCH_TAPS = 9;            // along each axis
layout(constant_id = 2) const bool NEAREST_BLOCKER = true;    // search only as far as the nearest blocker requires
layout(constant_id = 3) const bool ALONG_LIGHT = false;
layout(constant_id = 4) const bool KEEP_CONTACTS = false;     // seeds without a penumbra stay seeds
layout(constant_id = 5) const bool FILTER_IN_WORLD = false;   // the filter's width is in world units, not a share
layout(constant_id = 6) const bool FIXED = false;             // the point's own depth instead of the receiver's plane
layout(constant_id = 7) const bool MEAN_DEPTH = false;        // average the blockers' stored depths, as in the paper

layout(local_size_x = 64) in;

layout(binding = 3) uniform sampler2DArray shadow_map;
layout(binding = 4, scalar) readonly buffer PixelList {
  uint groups[3];
  uint count;
  uint pixels[];
} list;
layout(binding = 5, scalar) readonly buffer Seeds { uvec3 seeds[]; };
layout(binding = 6, scalar) buffer SeedBits { uint seed_bits[]; };
// Values at seeds: full width in world units, or 0; and the smallest factor by which the measure shortens a length on
// the surface.
layout(binding = 8) writeonly uniform image2D widths;
layout(binding = 9) uniform sampler2D hsm; // read if NEAREST_BLOCKER

layout(binding = 10, scalar) buffer Coarse {
  uint coarse_groups[3][3];
  int farthest; // reach of the widest penumbra, pixels
};

// Half-width of the narrowest window, texels. A revectorized edge may lie up to a texel away from its blocker.
const float NARROWEST_SEARCH = 1.5;
// A width of fewer pixels counts as none.
const float NARROWEST_WIDTH = 1e-3;
// Penumbrae that the light grazes are lengthened by at most the inverse of this.
const float LEAST_COSINE = 0.1;
// Smallest ratio of the measure of nearest_edge.glsl to the length: along the diagonal of the light's square.
const float DIAGONAL = 0.804737;

float widthAt(ivec2 pixel) {
  AreaLight a = areaLight();
  SoftReceiver r;
  float decided;
  if (softReceiver(pixel, a, push.normal_offset, push.depth_bias, r, decided)) return 0.0;
  if (FIXED) r.slope = vec2(0.0);
  precise vec2 search = max(searchWindow(hsm, r, a, NEAREST_BLOCKER), NARROWEST_SEARCH / vec2(view.map_size));
  // Moves the outer taps to the window's rim: the caster of the edge may lie no nearer.
  float to_rim = float(SEARCH_TAPS) / float(max(SEARCH_TAPS - 1, 1));
  precise vec2 taps = search * to_rim;
  Blockers b = findBlockers(shadow_map, r, a, taps, SEARCH_TAPS, MEAN_DEPTH);
  return b.count > 0 ? push.beta * penumbraWidth(a, r.z, b.z) : 0.0;
}

void workOn(ivec2 pixel) {
  uint word = pixel.x + view.size.x * (pixel.y / 32), bit = 1u << (pixel.y & 31);
  if ((seed_bits[word] & bit) == 0) return;
  uvec3 seed = seeds[seedIndex(pixel)];
  vec3 point = seedPoint(pixel, seed);
  float width = widthAt(pixel);
  if (!(width >= NARROWEST_WIDTH * pixelWidth(point))) width = 0.0;
  float cosine = ALONG_LIGHT ? DIAGONAL * max(dot(seedNormal(seed), towardsLight(point, 0)), LEAST_COSINE) : 1.0;
  imageStore(widths, pixel, vec4(width, cosine, 0.0, 0.0));
  if (width == 0.0) {
    if (!KEEP_CONTACTS) atomicAnd(seed_bits[word], ~bit);
    return;
  }
  // The filter reads half its width beyond the pixels that it changes.
  ivec2 first, last;
  float filter_share = filterShare(width, FILTER_IN_WORLD);
  float reach = (0.5 * (push.penumbra + filter_share) + 0.5 * filter_share) * width / cosine;
  int pixels = tilesInReach(pixel, reach, eyeDepth(point), AROUND_LINE, first, last);
  if (pixels > farthest) atomicMax(farthest, pixels);
  mark(first, last);
}

void main() {
  uint threads = 64 * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < list.count; i += threads) workOn(unpackTile(list.pixels[i]));
}
