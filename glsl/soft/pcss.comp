#version 460
// Percentage-closer soft shadows: Fernando (2005). The mean distance of the blockers found gives the penumbra width,
// and shadow tests are averaged over that width. Pixels whose whole search window is lit or in shadow according to the
// hierarchical shadow map skip both steps; the image is the same, bit for bit.
//
// Taps lie at the centres of a regular grid over the window, as in the papers. The outermost taps do not reach its rim,
// so a penumbra loses its lit rim, at most half a tap's share of it. Taps that reach the rim give blockers far from the
// receiver too much weight; they increased the error on each of five scenes.
//
// Departures: see common/blockers.glsl for those of the search. Texels are tested on the receiver's plane; FIXED compares
// all with the point's own depth, as in the paper. A window without blockers is lit. But a window in which
// every tap found a blocker is still filtered, since light may fall through a gap between taps.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "common/soft_receiver.glsl"
#include "common/blockers.glsl"
#include "lib/pcf.glsl"
#include "common/pcf_bounds.glsl"
#include "common/hsm.glsl"
#include "soft_filter.glsl"
#include "common/pixel_steps.glsl"
#include "common/quad_classes.glsl"
#include "common/tile_classes.glsl"

layout(constant_id = 0) const int SEARCH_TAPS = 9;      // along each axis
layout(constant_id = 1) const int FILTER_TAPS = 15;     // along each axis
layout(constant_id = 2) const bool BILINEAR = true;     // filter taps weight 2 x 2 tests; false: test one texel
layout(constant_id = 3) const bool BOX = true;          // compute the exact mean in windows of up to FILTER_TAPS texels
layout(constant_id = 5) const bool NEAREST_BLOCKER = true; // search only as far as the nearest blocker requires
layout(constant_id = 6) const bool FIXED = false;       // the point's own depth instead of the receiver's plane
layout(constant_id = 7) const bool MEAN_DEPTH = false;  // average the blockers' stored depths, as in the paper

layout(binding = 3) uniform sampler2DArray shadow_map;
layout(binding = 6) uniform sampler2D hsm;    // hsm.comp; read if NEAREST_BLOCKER or STEP is LIST
layout(binding = 7) uniform sampler2D blocks; // depth_bounds.comp; read if STEP is LIST
layout(binding = 8) uniform sampler2D half_widths; // soft_auto.comp; of the filter, texels; read if STEP is MEASURED

layout(push_constant, scalar) uniform Push {
  float normal_offset; // multiples of the offset that a plane needs
  float depth_bias;    // fraction of the plane's change of depth per texel, over both axes
} push;

float filterAny(SoftReceiver r, vec2 half_texels) {
  bool box = BOX && all(lessThanEqual(2.0 * half_texels, vec2(FILTER_TAPS)));
  float v;
  if (box) v = filterBox(shadow_map, r, half_texels);
  else v = filterTaps(shadow_map, r, half_texels, FILTER_TAPS, BILINEAR);
  return v;
}

// Returns true if the pixel needs no window; its visibility, 0 or 1, is then `v`. `least` is the least half-width (uv) of
// its search window.
bool needsNoWindow(ivec2 pixel, AreaLight a, out SoftReceiver r, out vec2 least, out float v) {
  least = NARROWEST_SEARCH / vec2(view.map_size);
  if (softReceiver(pixel, a, push.normal_offset, push.depth_bias, r, v)) return true;
  if (FIXED) r.slope = vec2(0.0);
  return false;
}

bool visibilityAt(ivec2 pixel, out float v) {
  AreaLight a = areaLight();
  SoftReceiver r;
  vec2 least;
  if (needsNoWindow(pixel, a, r, least, v)) return true;
  if (STEP == MEASURED) {
    v = filterAny(r, texelFetch(half_widths, pixel, 0).xy);
    return true;
  }
  precise vec2 search;
  int found = HSM_PENUMBRA;
  if (STEP == OPEN_TILES) search = searchWindow(hsm, r, a, NEAREST_BLOCKER, 1.0, least, 0.5, found);
  else search = max(searchWindow(hsm, r, a, NEAREST_BLOCKER), least);
  Blockers b = findBlockers(shadow_map, r, a, search, SEARCH_TAPS, MEAN_DEPTH, found == HSM_PENUMBRA);
  v = found == HSM_UMBRA ? 0.0 : 1.0;
  if (b.count > 0) v = filterAny(r, softHalfTexels(r, a, b.z, search));
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
  if (STEP == OPEN_TILES) {
    for (uint i = gl_WorkGroupID.x; i < open_tiles.count; i += gl_NumWorkGroups.x) {
      ivec2 pixel;
      if (openTilePixel(i, pixel) && visibilityAt(pixel, v)) imageStore(visibility, pixel, vec4(v));
    }
    return;
  }
  if (decidesTiles()) {
    ivec2 corner = 8 * ivec2(gl_GlobalInvocationID.xy);
    int found = classifyTile(hsm, blocks, corner, areaLight(), push.normal_offset, push.depth_bias, FIXED, NEAREST_BLOCKER, 1.0, NARROWEST_SEARCH, 0.5);
    storeTile(visibility, corner, found);
    listTile(corner, found);
    return;
  }
  if (STEP == LIST) {
    AreaLight a = areaLight();
    for (uint first_tile = firstOpenTile(); first_tile < open_tiles.count; first_tile += openTileStride()) {
      ivec2 corner = quadCorner(first_tile);
      Quad q;
      [[unroll]] for (int i = 0; i < 4; ++i) {
        ivec2 pixel = quadPixel(corner, i);
        v = 1.0;
        bool is_open = all(lessThan(pixel, ivec2(view.size))) && !needsNoWindow(pixel, a, q.r[i], q.least[i], v);
        q.found[i] = is_open ? HSM_PENUMBRA : int(v);
      }
      ivec4 found = classifyQuad(hsm, blocks, q, a, NEAREST_BLOCKER, 1.0, 0.5);
      storeQuad(visibility, corner, found);
      listQuad(corner, found);
    }
    return;
  }
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  bool inside = all(lessThan(pixel, ivec2(view.size)));
  if (inside && visibilityAt(pixel, v)) imageStore(visibility, pixel, vec4(v));
}
