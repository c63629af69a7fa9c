// A camera pixel's surface point as the shadow map of an area light sees it. The shader declares its own push
// constants.
// Include after common/receiver.glsl.
#ifndef EDGESHADE_SOFT_RECEIVER
#define EDGESHADE_SOFT_RECEIVER
#include "lib/area_light.glsl"
#include "lib/shadow_test.glsl"

struct SoftReceiver {
  MapReceiver map;
  vec2 at;    // place in the map, texels; texel t covers t to t + 1
  vec2 slope; // change of the plane's depth per texel
  float z;    // linear distance of map.depth, see lib/area_light.glsl
};

AreaLight areaLight() { return areaLight(view.light_area[0], view.light_depth_scale[0]); }

// Returns true if the visibility needs no texel of the shadow map; `decided` then holds it. The settings are those of
// mapReceiver.
bool softReceiver(ivec2 pixel, AreaLight a, float normal_offset, float depth_bias, out SoftReceiver r, out float decided) {
  if (mapReceiver(receiverAt(pixel), normal_offset, depth_bias, r.map, decided)) return true;
  precise vec2 at = r.map.uv * vec2(view.map_size);
  precise vec2 slope = r.map.plane / vec2(view.map_size);
  r.at = at;
  r.slope = slope;
  r.z = lightDistance(a, r.map.depth);
  return false;
}

// Depth of the receiver's plane at a texel's centre, bias subtracted.
float softReference(SoftReceiver r, ivec2 texel) {
  precise vec2 away = vec2(texel) + 0.5 - r.at;
  precise float reference = r.map.depth + (r.slope.x * away.x + r.slope.y * away.y);
  return reference;
}

// Converts a half-width from uv to texels. The limit is wider than any map, so it changes no result, and it fits into
// an integer.
vec2 windowTexels(vec2 half_width) {
  precise vec2 texels = min(half_width * vec2(view.map_size), vec2(65536.0));
  return texels;
}

// Depths of the receiver's plane at 2 x 2 texels in gather order: (0, 1), (1, 1), (1, 0), (0, 0). Outside the map they
// are those of its border, as the sampler's depths are.
vec4 softReference2x2(SoftReceiver r, ivec2 first) {
  ivec2 low = nearestTexel(first, ivec2(view.map_size)), high = nearestTexel(first + 1, ivec2(view.map_size));
  float corner = softReference(r, low);
  precise vec2 step = r.slope * vec2(high - low);
  precise vec4 reference = corner + vec4(step.y, step.x + step.y, step.x, 0.0);
  return reference;
}

// The texel under tap (i, j) of n x n taps, which lie at the centres of a regular grid over the window.
ivec2 tapTexel(SoftReceiver r, vec2 half_texels, int i, int j, int n) {
  precise vec2 t = (2.0 * vec2(i, j) + 1.0) / float(n) - 1.0;
  precise vec2 place = floor(r.at + t * half_texels);
  return ivec2(place);
}

// The same texel; outside the map it is the nearest border texel.
ivec2 windowTap(SoftReceiver r, vec2 half_texels, int i, int j, int n) {
  return nearestTexel(tapTexel(r, half_texels, i, j, n), ivec2(view.map_size));
}

#endif
