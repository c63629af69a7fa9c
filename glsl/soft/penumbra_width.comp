#version 460
// Finds the penumbra width that an area light casts at every pixel, in world units; 0 where there is no penumbra.
// Macedo, Apolinario, Aguero (2019), eq. 6 and 7. Filters of the hard-shadow image read it.
//
// Pixels whose whole search window is lit or in shadow according to the hierarchical shadow map have no penumbra,
// whatever width their blockers would give. Their visibility is then known as well. Where pixels are listed, widths are
// written for the listed pixels only.
//
// Departures: see common/blockers.glsl. Texels are tested on the receiver's plane; FIXED compares all with the point's own
// depth, as in the paper.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "common/soft_receiver.glsl"
#include "common/blockers.glsl"
#include "lib/pcf.glsl"
#include "common/pcf_bounds.glsl"
#include "common/hsm.glsl"
#include "common/pixel_steps.glsl" // its image `visibility` holds the widths here
#include "common/quad_classes.glsl"
#include "common/tile_classes.glsl"

layout(constant_id = 0) const int TAPS = 23;               // of the search, along each axis
layout(constant_id = 1) const bool NEAREST_BLOCKER = true; // search only as far as the nearest blocker requires
layout(constant_id = 2) const bool BOX = true;             // compute the exact mean in windows of up to TAPS texels

layout(constant_id = 3) const bool FIXED = false;          // the point's own depth instead of the receiver's plane
layout(constant_id = 5) const bool MEAN_DEPTH = false;     // average the blockers' stored depths, as in the paper

layout(binding = 3) uniform sampler2DArray shadow_map;
layout(binding = 6) uniform sampler2D hsm;    // hsm.comp
layout(binding = 7) uniform sampler2D blocks; // depth_bounds.comp
// Written where the visibility is known: the result, and the output of the filter's first pass.
layout(binding = 8) writeonly uniform image2D shadows;
layout(binding = 9) writeonly uniform image2D between;

layout(push_constant, scalar) uniform Push {
  float normal_offset; // multiples of the offset that a plane needs
  float depth_bias;    // fraction of the plane's change of depth per texel, over both axes
  float reach;         // half-width of the filter to come in penumbra half-widths, at least 1: widths must exist this far
} push;

// Half-width of the narrowest window, texels. A revectorized edge lies within a texel of the original one.
const float NARROWEST_SEARCH = 1.0;

// findBlockers with infinitely many taps. It reads every texel once, four per gather, and weights it by its share of
// the window. It also reads the texels up to `margin` texels around it, and `found` is the class of them all. A search that is
// not `wanted` reads none.
Blockers findBlockersBox(SoftReceiver r, AreaLight a, vec2 half_width, float margin, bool wanted, out int found) {
  vec2 half_texels = windowTexels(half_width);
  precise vec2 low = r.at - half_texels, high = r.at + half_texels;
  ivec2 first, last;
  windowRange(r, half_width, margin, first, last);
  ivec2 end = wanted ? last : first - 1;
  precise float sum = 0.0, weight = 0.0;
  bool lit = false, dark = false;
  [[dont_unroll]] for (int y = first.y; y <= end.y; y += 2) {
    precise vec2 height = max(min(vec2(y, y + 1) + 1.0, high.y) - max(vec2(y, y + 1), low.y), 0.0);
    [[dont_unroll]] for (int x = first.x; x <= end.x; x += 2) {
      // Rounding cannot select other texels at the common corner of the four.
      vec4 stored = textureGather(shadow_map, vec3(vec2(x + 1, y + 1) / vec2(view.map_size), 0.0));
      bvec4 blocked = greaterThan(min(softReference2x2(r, ivec2(x, y)), vec4(1.0)), stored);
      bvec4 inside = bvec4(y < last.y, x < last.x && y < last.y, x < last.x, true);
      dark = dark || any(bvec4(ivec4(blocked) & ivec4(inside)));
      lit = lit || any(bvec4(ivec4(not(blocked)) & ivec4(inside)));
      precise vec2 width = max(min(vec2(x, x + 1) + 1.0, high.x) - max(vec2(x, x + 1), low.x), 0.0);
      precise vec4 share = width.xyyx * height.yyxx * vec4(blocked);
      sum += dot(share, blockerValues(a, stored, MEAN_DEPTH));
      weight += dot(share, vec4(1.0));
    }
  }
  // Outside the map other passes see light.
  bool leaves = any(lessThan(first, ivec2(0))) || any(greaterThanEqual(last, ivec2(view.map_size)));
  found = !wanted || lit && dark || dark && leaves ? HSM_PENUMBRA : dark ? HSM_UMBRA : HSM_LIT;
  precise float mean = sum / max(weight, 1e-30);
  return Blockers(blockerDistance(a, mean, MEAN_DEPTH), weight > 0.0 ? 1 : 0);
}

// Returns true if the pixel needs no window; its visibility, 0 or 1, is then `v`. `least` is the least half-width (uv) of
// its search window.
bool needsNoWindow(ivec2 pixel, AreaLight a, out SoftReceiver r, out vec2 least, out float v) {
  least = NARROWEST_SEARCH / vec2(view.map_size);
  if (softReceiver(pixel, a, push.normal_offset, push.depth_bias, r, v)) return true;
  if (FIXED) r.slope = vec2(0.0);
  return false;
}

// Returns false if the pixel's visibility is known; otherwise `width` is its penumbra width.
bool measure(ivec2 pixel, out float width) {
  const float MARGIN = 0.5;
  AreaLight a = areaLight();
  SoftReceiver r;
  vec2 least;
  float v;
  width = 0.0;
  if (!needsNoWindow(pixel, a, r, least, v)) {
    int found;
    precise vec2 search = searchWindow(hsm, r, a, NEAREST_BLOCKER, push.reach, least, MARGIN, found);
    bool is_open = found == HSM_PENUMBRA, is_narrow = BOX && all(lessThanEqual(2.0 * windowTexels(search), vec2(TAPS)));
    int found_by_box;
    Blockers b = findBlockersBox(r, a, search, MARGIN, is_open && is_narrow, found_by_box), by_taps;
    if (is_open && is_narrow) found = found_by_box;
    int looks = is_open && !is_narrow ? 1 : 0;
    [[dont_unroll]] for (int k = 0; k < looks; ++k) found = classify(hsm, blocks, r, search, MARGIN);
    by_taps = findBlockers(shadow_map, r, a, search, TAPS, MEAN_DEPTH, !is_narrow && found == HSM_PENUMBRA);
    if (!is_narrow) b = by_taps;
    if (b.count > 0) width = penumbraWidth(a, r.z, b.z);
    v = float(found);
    if (found == HSM_PENUMBRA) return true;
  }
  width = 0.0;
  imageStore(shadows, pixel, vec4(v));
  imageStore(between, pixel, vec4(v));
  return false;
}

void main() {
  float width = 0.0;
  if (readsList()) {
    for (uint i = firstListed(); i < list.count; i += listStride()) {
      ivec2 pixel = unpackTile(list.pixels[i]);
      measure(pixel, width);
      imageStore(visibility, pixel, vec4(width));
    }
    return;
  }
  if (STEP == OPEN_TILES) {
    for (uint i = gl_WorkGroupID.x; i < open_tiles.count; i += gl_NumWorkGroups.x) {
      ivec2 pixel;
      bool inside = openTilePixel(i, pixel), is_open = false;
      if (inside) is_open = measure(pixel, width);
      [[dont_unroll]] for (; is_open; is_open = false) {
        imageStore(visibility, pixel, vec4(width));
        APPEND_PIXEL(list, pixel)
      }
    }
    return;
  }
  if (decidesTiles()) {
    ivec2 corner = 8 * ivec2(gl_GlobalInvocationID.xy);
    int found = classifyTile(hsm, blocks, corner, areaLight(), push.normal_offset, push.depth_bias, FIXED, NEAREST_BLOCKER, push.reach, NARROWEST_SEARCH, 0.5);
    storeTile(shadows, corner, found);
    storeTile(between, corner, found);
    listTile(corner, found);
    return;
  }
  if (STEP == LIST) {
    AreaLight a = areaLight();
    float v;
    for (uint first_tile = firstOpenTile(); first_tile < open_tiles.count; first_tile += openTileStride()) {
      ivec2 corner = quadCorner(first_tile);
      Quad q;
      [[unroll]] for (int i = 0; i < 4; ++i) {
        ivec2 pixel = quadPixel(corner, i);
        v = 1.0;
        bool is_open = all(lessThan(pixel, ivec2(view.size))) && !needsNoWindow(pixel, a, q.r[i], q.least[i], v);
        q.found[i] = is_open ? HSM_PENUMBRA : int(v);
      }
      ivec4 found = classifyQuad(hsm, blocks, q, a, NEAREST_BLOCKER, push.reach, 0.5);
      storeQuad(shadows, corner, found);
      storeQuad(between, corner, found);
      listQuad(corner, found);
    }
    return;
  }
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (all(lessThan(pixel, ivec2(view.size)))) {
    measure(pixel, width);
    imageStore(visibility, pixel, vec4(width));
  }
}
