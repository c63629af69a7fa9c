#version 460
// A hybrid of soft shadows: what every pixel in a penumbra is worth. The papers name it as future work ([CGF] Macedo, Apolinario,
// Aguero (2019), section 8); the choice is ours.
//
// Blockers are searched for and give the width of the filter, as in rbssm.comp. Where the filter's own window turns out lit or
// in shadow, that is the pixel's visibility; the others go onto one of three lists:
// * hard: the filter is narrower on the screen than HARD_PIXELS. Revectorized without any filter (rbsm.comp).
// * kernel: the filter is narrower than KERNEL_TEXELS of the map, and beside the pixel there is no texel between two that differ
//   from it. Revectorized under every tap (rbssm.comp).
// * wide: the others. Texels are tested as they are (pcss.comp). Of bars and gaps one texel wide revectorization knows no more
//   than the texels, and leaves them hard. But where what blocks is within THIN_DISTANCE of the receiver, they are noise of
//   the receiver's own depth, which plain tests would spread.
#extension GL_GOOGLE_include_directive : require
#define MAP_GOES_ON
#include "common/receiver.glsl"
#include "common/map_receiver.glsl"
#include "common/soft_receiver.glsl"
#include "common/blockers.glsl"
#include "common/rbsm_receiver.glsl"
#include "edge_blockers.glsl"
#include "lib/pcf.glsl"
#include "common/pcf_bounds.glsl"
#include "common/hsm.glsl"
#include "soft_filter.glsl"
#include "common/pixel_steps.glsl"

layout(constant_id = 1) const int SEARCH_TAPS = 9;         // by axis
layout(constant_id = 2) const bool CLASSIFY = true;        // decide windows that are lit or in shadow all over
layout(constant_id = 3) const bool NEAREST_BLOCKER = true; // search only as far as the nearest blocker allows
layout(constant_id = 5) const float LEAST_WIDTH = 1.0;     // of the filter, texels
layout(constant_id = 6) const float HARD_PIXELS = 0.5;
layout(constant_id = 7) const float KERNEL_TEXELS = 2.0;
layout(constant_id = 8) const float THIN_DISTANCE = 16.0;

layout(binding = 6) uniform sampler2D hsm;    // hsm.comp; read if NEAREST_BLOCKER or CLASSIFY
layout(binding = 7) uniform sampler2D blocks; // depth_bounds.comp; read if CLASSIFY
layout(binding = 8) writeonly uniform image2D half_widths; // of listed pixels' filters, texels
layout(binding = 9, scalar) buffer HardList {
  uint groups[3];
  uint count;
  uint tiles;
  uint pixels[];
} hard;
layout(binding = 10, scalar) buffer KernelList {
  uint groups[3];
  uint count;
  uint tiles;
  uint pixels[];
} kernel;
layout(binding = 11, scalar) buffer WideList {
  uint groups[3];
  uint count;
  uint tiles;
  uint pixels[];
} wide;

// The first pixel of a group of 64 adds the group to the dispatch.
#define APPEND(to, pixel)                                                            \
  {                                                                                  \
    uint index = atomicAdd(to.count, 1);                                             \
    to.pixels[index] = packTile(uvec2(pixel));                                       \
    if (index % 64 == 0 && index / 64 < MAX_TILE_GROUPS) atomicAdd(to.groups[0], 1); \
  }

// Cosine below which a plane counts as lit at that angle.
const float GRAZING = 0.05;
// Without either, texels are tested as they are everywhere, and the windows are those of pcss.comp.
bool isRevectorized() { return HARD_PIXELS > 0.0 || KERNEL_TEXELS > 0.0; }

// Full width of the filter where it falls onto the receiver's plane, pixels: no narrower in any direction.
float widthOnScreen(ivec2 pixel, SoftReceiver r, AreaLight a, vec2 half_texels) {
  if (a.world == 0.0) return 0.0;
  Receiver s = receiverAt(pixel);
  // World units a unit of uv.
  precise vec2 map_width = a.world / a.uv * (a.depth_scale > 0.0 ? r.z : 1.0);
  precise vec2 width = 2.0 * half_texels / vec2(view.map_size) * map_width;
  precise float facing = max(dot(s.normal, towardsLight(s.position, 0)), GRAZING);
  precise float pixel_width = view.pixel_size.x * abs(s.position.z) + view.pixel_size.y;
  precise float pixels = max(width.x, width.y) / (facing * pixel_width);
  return pixels;
}

// Whether among the texel and the eight around it there is one between two, along either axis, that both differ from it.
bool isThin(ShadowPoint p) {
  // Tests of 6 x 6 texels from the one two before, a bit each.
  uint rows[6];
  for (int j = 0; j < 6; j += 2) {
    rows[j] = rows[j + 1] = 0u;
    for (int i = 0; i < 6; i += 2) {
      uint tests = shadowTest2x2(p, p.texel - 2 + ivec2(i, j));
      rows[j] |= (tests & 3u) << i;
      rows[j + 1] |= tests >> 2 << i;
    }
  }
  uint thin = 0u;
  for (int j = 1; j <= 3; ++j) {
    uint row = rows[j];
    thin |= (row ^ row << 1) & (row ^ row >> 1) | (row ^ rows[j - 1]) & (row ^ rows[j + 1]);
  }
  return (thin & 14u) != 0u;
}

// How far blockers are from the receiver along the light, widths of a texel there.
float blockerDistance(SoftReceiver r, AreaLight a, float z_blocker) {
  precise float depth = a.depth_scale > 0.0 ? a.depth_offset - a.depth_scale / z_blocker : z_blocker / a.depth_offset;
  precise float texels = (r.map.depth - depth) / r.map.texel_depth;
  return texels;
}

bool visibilityAt(ivec2 pixel, out float v) {
  AreaLight a = areaLight();
  SoftReceiver r;
  if (softReceiver(pixel, a, push.normal_offset, push.depth_bias, r, v)) return true;
  precise vec2 least = isRevectorized() ? leastHalfTexels(r, a, LEAST_WIDTH) : vec2(NARROWEST_SEARCH);
  precise vec2 search = max(searchWindow(hsm, r, a, NEAREST_BLOCKER), least / vec2(view.map_size));
  int found = HSM_PENUMBRA;
  if (STEP == LIST) {
    // With the ring around it, by which edges are known.
    if (CLASSIFY) found = classify(hsm, blocks, r, search, 1.0);
    v = float(found);
    return found != HSM_PENUMBRA;
  }
  Blockers b = findBlockers(shadow_map, r, a, search, SEARCH_TAPS);
  ShadowPoint p = shadowPoint(r.at, r.map.depth, r.slope, 0.0);
  if (isRevectorized() && b.count == 0) b = neighbouringBlockers(p, a);
  v = 1.0;
  if (b.count == 0) return true;
  precise vec2 narrow = edgeHalfTexels(r, a, b.z, least, search);
  bool is_kernel = 2.0 * max(narrow.x, narrow.y) < KERNEL_TEXELS;
  if (KERNEL_TEXELS > 0.0) is_kernel = is_kernel && (blockerDistance(r, a, b.z) <= THIN_DISTANCE || !isThin(p));
  precise vec2 half_texels = is_kernel ? narrow : softHalfTexels(r, a, b.z, search);
  if (CLASSIFY) found = classify(hsm, blocks, r, half_texels / vec2(view.map_size), 1.0);
  v = float(found);
  if (found != HSM_PENUMBRA) return true;
  imageStore(half_widths, pixel, vec4(half_texels, 0.0, 0.0));
  if (HARD_PIXELS > 0.0 && widthOnScreen(pixel, r, a, narrow) < HARD_PIXELS) APPEND(hard, pixel)
  else if (is_kernel) APPEND(kernel, pixel)
  else APPEND(wide, pixel)
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
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  bool inside = all(lessThan(pixel, ivec2(view.size)));
  bool decided = inside && visibilityAt(pixel, v);
  if (decided) imageStore(visibility, pixel, vec4(v));
  listPixel(pixel, inside && !decided);
}
