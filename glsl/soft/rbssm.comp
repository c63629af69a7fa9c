#version 460
// Revectorization-based soft shadow mapping: [CGF] Macedo, Apolinario, Aguero, "Revectorization-based soft shadow
// mapping" (2019), algorithms 2 and 3. The mean distance of the blockers found gives the penumbra width, and
// revectorized visibility is averaged over that width. Pixels whose whole search window is lit or in shadow according
// to the hierarchical shadow map skip both steps; the image is the same, bit for bit.
//
// Departures: the default visibility is RBSM*, on both sides of an edge, because listing 4 grows the shadow. See
// edge_blockers.glsl, revectorized_filter.glsl and common/blockers.glsl for the others. Texels are tested on the
// receiver's plane; FIXED compares all with the point's own depth, as in the paper.
#extension GL_GOOGLE_include_directive : require
layout(constant_id = 1) const int MAX_DISTANCE = 16;
#define MAXDIST MAX_DISTANCE
#define MAP_GOES_ON
#include "common/receiver.glsl"
#include "common/soft_receiver.glsl"
#include "common/blockers.glsl"
#include "common/rbsm_receiver.glsl"
#include "edge_blockers.glsl"
#include "lib/pcf.glsl"
#include "common/pcf_bounds.glsl"
#include "common/hsm.glsl"
#include "lib/rbsm_star.glsl"
// Wider windows of bits would take too many registers.
#define WINDOW_MOST 16
#include "lib/texel_window.glsl"
#include "revectorized_filter.glsl"
#include "common/pixel_steps.glsl"
#include "common/quad_classes.glsl"
#include "common/tile_classes.glsl"

layout(constant_id = 2) const int SEARCH_TAPS = 9;         // along each axis
layout(constant_id = 6) const bool NEAREST_BLOCKER = true; // search only as far as the nearest blocker requires
layout(constant_id = 7) const float LEAST_WIDTH = 1.0;     // of the filter, texels
layout(constant_id = 10) const bool MEAN_DEPTH = false;    // average the blockers' stored depths, as in the paper

layout(binding = 6) uniform sampler2D hsm;    // hsm.comp; read if NEAREST_BLOCKER or STEP is LIST
layout(binding = 7) uniform sampler2D blocks; // depth_bounds.comp; read if STEP is LIST
layout(binding = 8) uniform sampler2D half_widths; // soft_auto.comp; of the filter, texels; read if STEP is MEASURED

// Returns true if the pixel needs no window; its visibility, 0 or 1, is then `v`. `least` is the least half-width (uv) of
// its search window.
bool needsNoWindow(ivec2 pixel, AreaLight a, out SoftReceiver r, out vec2 least, out float v) {
  least = vec2(0.0);
  if (softReceiver(pixel, a, push.normal_offset, push.depth_bias, r, v)) return true;
  if (FIXED) r.slope = vec2(0.0);
  least = leastHalfTexels(r, a, LEAST_WIDTH) / vec2(view.map_size);
  return false;
}

bool visibilityAt(ivec2 pixel, out float v) {
  AreaLight a = areaLight();
  SoftReceiver r;
  if (softReceiver(pixel, a, push.normal_offset, push.depth_bias, r, v)) return true;
  if (FIXED) r.slope = vec2(0.0);
  ShadowPoint p = shadowPoint(r.at, r.map.depth, r.slope, 0.0);
  if (STEP == MEASURED) {
    v = filterRevectorized(p, r, texelFetch(half_widths, pixel, 0).xy);
    return true;
  }
  precise vec2 least = leastHalfTexels(r, a, LEAST_WIDTH);
  precise vec2 search;
  int found = HSM_PENUMBRA;
  if (STEP == OPEN_TILES) search = searchWindow(hsm, r, a, NEAREST_BLOCKER, 1.0, least / vec2(view.map_size), 1.0, found);
  else search = max(searchWindow(hsm, r, a, NEAREST_BLOCKER), least / vec2(view.map_size));
  bool is_open = found == HSM_PENUMBRA;
  Blockers b = findBlockers(shadow_map, r, a, search, SEARCH_TAPS, MEAN_DEPTH, is_open);
  if (b.count == 0) b = neighbouringBlockers(p, a, MEAN_DEPTH, is_open);
  v = found == HSM_UMBRA ? 0.0 : 1.0;
  precise vec2 half_texels = edgeHalfTexels(r, a, b.z, least, search);
  if (b.count > 0) v = filterRevectorized(p, r, half_texels);
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
    // The margin is the ring around the window, which reveals edges at its border.
    int found = classifyTile(hsm, blocks, corner, areaLight(), push.normal_offset, push.depth_bias, FIXED, NEAREST_BLOCKER, 1.0, 0.5 * LEAST_WIDTH, 1.0);
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
      ivec4 found = classifyQuad(hsm, blocks, q, a, NEAREST_BLOCKER, 1.0, 1.0);
      storeQuad(visibility, corner, found);
      listQuad(corner, found);
    }
    return;
  }
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  bool inside = all(lessThan(pixel, ivec2(view.size)));
  if (inside && visibilityAt(pixel, v)) imageStore(visibility, pixel, vec4(v));
}
