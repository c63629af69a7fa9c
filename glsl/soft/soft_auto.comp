#version 460
// Hybrid of soft-shadow techniques: each pixel in a penumbra gets the cheapest sufficient technique. The papers name
// such a hybrid as future work ([CGF] Macedo, Apolinario, Aguero (2019), section 8); the selection is this project's
// own.
//
// The blocker search gives the width of the filter, as in rbssm.comp. If the filter's own window turns out to be lit or
// in shadow, the visibility is known. Each other pixel goes onto one of two lists:
// * kernel: the filter is narrower than KERNEL_TEXELS in the map, and no bar or gap one texel wide is near. Every tap
//   is revectorized (rbssm.comp).
// * wide: all others. Texels are tested as they are (pcss.comp). Revectorization cannot improve bars and gaps one texel
//   wide, and would leave them hard. But if their blockers lie within THIN_DISTANCE of the receiver, they are noise of
//   the receiver's own depth, which plain tests would spread; these stay on the kernel list.
#extension GL_GOOGLE_include_directive : require
#define MAP_GOES_ON
#include "common/receiver.glsl"
#include "common/soft_receiver.glsl"
#include "common/blockers.glsl"
#include "common/rbsm_receiver.glsl"
#include "edge_blockers.glsl"
#include "lib/pcf.glsl"
#include "common/pcf_bounds.glsl"
#include "common/hsm.glsl"
#include "soft_filter.glsl"
#include "common/pixel_steps.glsl"
#include "common/quad_classes.glsl"
#include "common/tile_classes.glsl"

layout(constant_id = 1) const int SEARCH_TAPS = 9;         // along each axis
layout(constant_id = 2) const bool CLASSIFY = true;        // decide windows that are entirely lit or in shadow
layout(constant_id = 3) const bool NEAREST_BLOCKER = true; // search only as far as the nearest blocker requires
layout(constant_id = 5) const float LEAST_WIDTH = 1.0;     // of the filter, texels
layout(constant_id = 6) const float KERNEL_TEXELS = 2.0;
layout(constant_id = 7) const float THIN_DISTANCE = 16.0;

layout(binding = 6) uniform sampler2D hsm;    // hsm.comp; read if NEAREST_BLOCKER or CLASSIFY
layout(binding = 7) uniform sampler2D blocks; // depth_bounds.comp; read if CLASSIFY
layout(binding = 8) writeonly uniform image2D half_widths; // of the listed pixels' filters, texels
layout(binding = 9, scalar) buffer KernelList {
  uint groups[3];
  uint count;
  uint tiles;
  uint pixels[];
} kernel;
layout(binding = 10, scalar) buffer WideList {
  uint groups[3];
  uint count;
  uint tiles;
  uint pixels[];
} wide;

// If false, all texels are tested as they are, and the windows are those of pcss.comp.
bool isRevectorized() { return KERNEL_TEXELS > 0.0; }

// Tests of 6 x 6 texels as bits, starting two texels before the point's texel.
struct Around {
  uint rows[6];
};

Around testAround(ShadowPoint p) {
  Around t;
  [[unroll]] for (int j = 0; j < 6; j += 2) {
    t.rows[j] = t.rows[j + 1] = 0u;
    [[unroll]] for (int i = 0; i < 6; i += 2) {
      uint tests = shadowTest2x2(p, p.texel - 2 + ivec2(i, j));
      t.rows[j] |= (tests & 3u) << i;
      t.rows[j + 1] |= tests >> 2 << i;
    }
  }
  return t;
}

// Tests whether any of the point's texel and its eight neighbours is part of a thin bar or gap: the texels on both
// sides of it, along either axis, differ from it.
bool isThin(Around t) {
  uint thin = 0u;
  [[unroll]] for (int j = 1; j <= 3; ++j) {
    uint row = t.rows[j];
    thin |= (row ^ row << 1) & (row ^ row >> 1) | (row ^ t.rows[j - 1]) & (row ^ t.rows[j + 1]);
  }
  return (thin & 14u) != 0u;
}

// Class of a window with a half-width of at most one texel, with the ring of texels that reveals edges at its border.
int classifyAround(Around t, ShadowPoint p, SoftReceiver r, vec2 half_texels) {
  ivec2 first = ivec2(floor(r.at - half_texels)) - p.texel + 1, last = ivec2(floor(r.at + half_texels)) - p.texel + 3;
  uint columns = (2u << last.x) - (1u << first.x), lit = 0u, dark = 0u;
  [[unroll]] for (int j = 0; j < 6; ++j) {
    bool inside = j >= first.y && j <= last.y;
    lit |= inside ? t.rows[j] & columns : 0u;
    dark |= inside ? ~t.rows[j] & columns : 0u;
  }
  return dark == 0u ? HSM_LIT : lit == 0u ? HSM_UMBRA : HSM_PENUMBRA;
}

// Distance of the blockers from the receiver along the light, in widths of a texel there.
float blockerDistance(SoftReceiver r, AreaLight a, float z_blocker) {
  precise float depth = a.depth_scale > 0.0 ? a.depth_offset - a.depth_scale / z_blocker : z_blocker / a.depth_offset;
  precise float texels = (r.map.depth - depth) / r.map.texel_depth;
  return texels;
}

// Least half-width of search and filter, texels.
vec2 leastTexels(SoftReceiver r, AreaLight a) {
  return isRevectorized() ? leastHalfTexels(r, a, LEAST_WIDTH) : vec2(NARROWEST_SEARCH);
}

// Returns true if the pixel needs no window; its visibility, 0 or 1, is then `v`. `least` is the least half-width (uv) of
// its search window.
bool needsNoWindow(ivec2 pixel, AreaLight a, out SoftReceiver r, out vec2 least, out float v) {
  least = vec2(0.0);
  if (softReceiver(pixel, a, push.normal_offset, push.depth_bias, r, v)) return true;
  least = leastTexels(r, a) / vec2(view.map_size);
  return false;
}

bool visibilityAt(ivec2 pixel, out float v) {
  AreaLight a = areaLight();
  SoftReceiver r;
  if (softReceiver(pixel, a, push.normal_offset, push.depth_bias, r, v)) return true;
  if (STEP == LIST) return false;
  vec2 least = leastTexels(r, a);
  precise vec2 search;
  int found = HSM_PENUMBRA;
  if (STEP == OPEN_TILES) search = searchWindow(hsm, r, a, NEAREST_BLOCKER, 1.0, least / vec2(view.map_size), 1.0, found);
  else search = max(searchWindow(hsm, r, a, NEAREST_BLOCKER), least / vec2(view.map_size));
  Blockers b = findBlockers(shadow_map, r, a, search, SEARCH_TAPS, false, found == HSM_PENUMBRA);
  ShadowPoint p = shadowPoint(r.at, r.map.depth, r.slope, 0.0);
  if (isRevectorized() && b.count == 0) b = neighbouringBlockers(p, a, false, found == HSM_PENUMBRA);
  if (found == HSM_PENUMBRA && b.count == 0) found = HSM_LIT;
  precise vec2 narrow = edgeHalfTexels(r, a, b.z, least, search), plain = softHalfTexels(r, a, b.z, search);
  bool is_kernel = 2.0 * max(narrow.x, narrow.y) < KERNEL_TEXELS;
  // A look at the texels around decides most pixels whose filter is narrow, and chooses for the others.
  int looks = found == HSM_PENUMBRA && is_kernel ? 1 : 0;
  [[dont_unroll]] for (int k = 0; k < looks; ++k) {
    Around t = testAround(p);
    vec2 wider = max(narrow, plain);
    if (CLASSIFY && all(lessThanEqual(wider, vec2(1.0)))) found = classifyAround(t, p, r, wider);
    is_kernel = blockerDistance(r, a, b.z) <= THIN_DISTANCE || !isThin(t);
  }
  v = float(found);
  if (found != HSM_PENUMBRA) return true;
  precise vec2 half_texels = is_kernel ? narrow : plain;
  imageStore(half_widths, pixel, vec4(half_texels, 0.0, 0.0));
  if (is_kernel) APPEND_PIXEL(kernel, pixel)
  else APPEND_PIXEL(wide, pixel)
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
    int found = classifyTile(hsm, blocks, corner, areaLight(), push.normal_offset, push.depth_bias, false, NEAREST_BLOCKER, 1.0, isRevectorized() ? 0.5 * LEAST_WIDTH : NARROWEST_SEARCH, 1.0);
    storeTile(visibility, corner, found);
    listTile(corner, found);
    return;
  }
  if (CLASSIFY) {
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
  bool decided = inside && visibilityAt(pixel, v);
  if (decided) imageStore(visibility, pixel, vec4(v));
  listPixel(pixel, inside && !decided);
}
