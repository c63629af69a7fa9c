#version 460
// One of two passes of a cross-bilateral filter over the hard-shadow image, as wide as each pixel's penumbra. It
// filters along one side of the penumbra's footprint, with taps on the pixel's own surface.
// Macedo, Apolinario, Aguero (2019), section 5 (box); Zheng, Saito (2011) (Gaussian); Pham, van Vliet, "Separable
// bilateral filtering for fast video preprocessing" (2005).
//
// Departures: lib/footprint.glsl describes the footprints, lib/penumbra.glsl the test for one surface. If the filter is
// no wider in pixels than the number of taps, taps lie one pixel apart, and the outermost count by the share of them
// that the box covers, so that its width changes smoothly. The first pass also stays on the surface (BILATERAL). By
// default a tap counts if it lies on the pixel's surface; Pham, van Vliet weigh it by a Gaussian of the difference, which
// is that of the eye depths here (SMOOTH_RANGE).
#extension GL_GOOGLE_include_directive : require
#include "lib/footprint.glsl"
#include "lib/penumbra.glsl"
#include "common/receiver.glsl"
#include "common/tiles.glsl"

const int SCREEN = 0, PLANE = 1, LIGHT = 2;

layout(constant_id = 0) const bool PLANES = true;     // separate surfaces by planes; false: by depth, as in the paper
layout(constant_id = 1) const bool SECOND = false;    // second pass, which writes the visibility
layout(constant_id = 2) const int TAPS = 23;          // maximum; odd
layout(constant_id = 3) const bool GAUSSIAN = false;  // false: box
layout(constant_id = 4) const int FOOTPRINT = LIGHT;
layout(constant_id = 5) const bool BILATERAL = true;  // stay on the pixel's surface
layout(constant_id = 6) const bool LISTED = false;    // filter only the listed pixels
layout(constant_id = 7) const bool SMOOTH_RANGE = false; // taps weigh by a Gaussian of their difference in depth

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 3) uniform sampler2D source; // hard visibility, or the first pass's result
layout(binding = 4) uniform sampler2D widths; // penumbra_width.comp
layout(binding = 5) writeonly uniform image2D target;
layout(binding = 6, scalar) readonly buffer PixelList {
  uint groups[3];
  uint count;
  uint tiles;
  uint pixels[];
} list;

layout(push_constant, scalar) uniform Push {
  float tolerance; // of the test for one surface: pixels off the plane per pixel of distance, or a share of the depth;
                   // with SMOOTH_RANGE the standard deviation, a share of the depth
  float sigma;     // of the Gaussian, in penumbra widths
} push;

// Cut-off of the Gaussian in standard deviations, and limit of a filter's side in pixels.
const float GAUSSIAN_REACH = 3.0, LONGEST = 4096.0;

PixelSteps pixelSteps(ivec2 pixel, float depth, vec3 p) {
  vec2 to_ndc = 2.0 / vec2(view.size);
  mat4 m = view.view_from_clip;
  precise float w = (m * vec4((vec2(pixel) + 0.5) * to_ndc - 1.0, depth, 1.0)).w;
  precise PixelSteps s;
  s.x = (m[0].xyz - p * m[0].w) * (to_ndc.x / w);
  s.y = (m[1].xyz - p * m[1].w) * (to_ndc.y / w);
  // A parallel projection looks along -Z everywhere.
  s.ray = m[2].w == 0.0 ? vec3(0.0, 0.0, -1.0) : p;
  return s;
}

// Half side of the filter, pixels.
vec2 filterReach(ivec2 pixel, float depth, Receiver r, float width) {
  PixelSteps s = pixelSteps(pixel, depth, r.position);
  mat4 light = view.light_clip_from_view[0];
  Footprint f;
  float half_width = 0.5 * width;
  if (FOOTPRINT == SCREEN) f = footprintScreen(s, half_width);
  else if (FOOTPRINT == PLANE) f = footprintPlane(s, r.normal, half_width);
  else f = footprintLight(s, r.normal, towardsLight(r.position, 0), normalize(rowOf(light, 0)), normalize(rowOf(light, 1)), half_width);
  precise vec2 reach = SECOND ? f.b : f.a;
  if (GAUSSIAN) reach *= 2.0 * push.sigma * GAUSSIAN_REACH;
  return reach;
}

float filtered(ivec2 pixel, float own, float width) {
  float depth = depthAt(pixel);
  Receiver p = receiverAt(pixel);
  precise vec2 reach = filterReach(pixel, depth, p, width);
  precise float length_in_pixels = max(abs(reach.x), abs(reach.y)), m = min(length_in_pixels, LONGEST);
  if (!(m > 0.5)) return own;
  precise vec2 along = reach / length_in_pixels;
  precise float between = max(2.0 * m / float(TAPS), 1.0), half_taps = m / between;
  int taps = min(int(ceil(half_taps - 0.5)), TAPS / 2);
  // The plane through p in clip space gives a tap's distance from the plane without the tap's position.
  precise vec4 plane = vec4(p.normal, -dot(p.normal, p.position)) * view.view_from_clip;
  vec4 w_row = vec4(view.view_from_clip[0][3], view.view_from_clip[1][3], view.view_from_clip[2][3], view.view_from_clip[3][3]);
  precise float off_plane = push.tolerance * (view.pixel_size.x * abs(p.position.z) + view.pixel_size.y);
  // Pixels outside a spot's light count as lit, which says nothing about its shadows: such taps are skipped. Pixels
  // outside a sun's map are truly lit, since the map holds all casters.
  bool is_spot = view.light_depth_scale[0] > 0.0;
  mat4 light_from_clip = view.light_clip_from_view[0] * view.view_from_clip;
  precise float by_sigma = GAUSSIAN_REACH / half_taps;
  precise float sum = 0.0, weights = 0.0;
  for (int i = -taps; i <= taps; ++i) {
    precise vec2 place = along * (between * float(i)) + 0.5;
    ivec2 offset = ivec2(floor(place)), at = pixel + offset;
    ivec2 inside = clamp(at, ivec2(0), ivec2(view.size) - 1);
    float value = texelFetch(source, inside, 0).x, tap_depth = texelFetch(camera_depth, inside, 0).x;
    precise vec4 clip = vec4((2.0 * vec2(at) + 1.0) / vec2(view.size) - 1.0, tap_depth, 1.0);
    precise float off = abs(dot(plane, clip)), signed_w = dot(w_row, clip), w = abs(signed_w);
    precise vec4 in_light = light_from_clip * clip * (signed_w < 0.0 ? -1.0 : 1.0);
    bool reached = any(bvec2(!is_spot, all(lessThanEqual(abs(in_light.xy), in_light.ww))));
    bool same = PLANES ? off <= off_plane * length(vec2(offset)) * w
                       : sameDepth(p.position.z, viewPosition(at, tap_depth).z, push.tolerance);
    bool surface = tap_depth != view.far_depth && abs(tap_depth) < 3.0e38; // not NaN or infinite
    bool taken = i == 0 || (same || SMOOTH_RANGE || !BILATERAL) && reached && at == inside && surface;
    precise float sigmas = by_sigma * float(i);
    precise float weight = GAUSSIAN ? exp(-0.5 * sigmas * sigmas) : clamp(half_taps + 0.5 - abs(float(i)), 0.0, 1.0);
    if (SMOOTH_RANGE && BILATERAL) {
      precise float apart = (viewPosition(at, tap_depth).z - p.position.z) / (push.tolerance * abs(p.position.z));
      weight *= exp(-0.5 * apart * apart);
    }
    sum += taken ? weight * value : 0.0;
    weights += taken ? weight : 0.0;
  }
  precise float mean = sum / weights;
  return mean;
}

void filterPixel(ivec2 pixel) {
  float own = texelFetch(source, pixel, 0).x, width = texelFetch(widths, pixel, 0).x;
  if (width > 0.0) own = filtered(pixel, own, width);
  imageStore(target, pixel, vec4(own));
}

void main() {
  if (!LISTED) {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (all(lessThan(pixel, ivec2(view.size)))) filterPixel(pixel);
    return;
  }
  uint threads = 64 * gl_NumWorkGroups.x;
  for (uint i = 64 * gl_WorkGroupID.x + gl_LocalInvocationIndex; i < list.count; i += threads) {
    filterPixel(unpackTile(list.pixels[i]));
  }
}
