// Windows of a summed-area table of moments under a receiver of an area light: where blockers are searched, and over
// which visibility is filtered.
// Include after common/soft_receiver.glsl, common/hsm.glsl, soft_filter.glsl, lib/moments.glsl and
// filtering/summed_area.glsl.
#ifndef EDGESHADE_MOMENT_WINDOW
#define EDGESHADE_MOMENT_WINDOW

layout(constant_id = 0) const bool CLASSIFIED = true;      // windows that are all lit or all in shadow decide
layout(constant_id = 1) const bool NEAREST_BLOCKER = true; // search only as far as the nearest blocker requires

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 3) uniform usampler2D table;
layout(binding = 4) writeonly uniform image2D visibility;
layout(binding = 5) uniform sampler2D hsm;    // hsm.comp
layout(binding = 6) uniform sampler2D blocks; // depth_bounds.comp; read if CLASSIFIED

layout(push_constant, scalar) uniform Push {
  float normal_offset;   // multiples of what a plane needs
  float depth_bias;      // share of the rise of the receiver's plane from a window's middle to its corner
  float range;           // far / near - 1, or 0 for a parallel light
  float scale;           // of the table
  float widest;          // half-width of the widest window, texels
  float reduction;       // largest visibility that counts as shadow
  float least_variance;  // of the signed depths in a window
  float moment_bias;     // share of moments that are certainly possible, see lib/moments.glsl
} push;

struct Window {
  vec2 low; // texels; the part that lies in the map
  vec2 high;
  float t;  // signed depth of the receiver, bias taken off
};

// The window around a receiver, no wider than the table is made for.
Window windowOf(SoftReceiver r, vec2 half_texels) {
  vec2 h = min(half_texels, vec2(push.widest));
  Window w;
  w.low = clamp(r.at - h, vec2(0.0), vec2(view.map_size));
  w.high = clamp(r.at + h, vec2(0.0), vec2(view.map_size));
  w.t = signedDepth(r.map.depth - push.depth_bias * dot(abs(r.slope), h), push.range);
  return w;
}

// Linear distance, as in lib/area_light.glsl, of a signed depth.
float distanceOf(AreaLight a, float x) {
  float part = 0.5 * x + 0.5;
  return a.depth_scale > 0.0 ? a.near * (1.0 + push.range * part) : a.depth_offset * part;
}

// Returns true if nothing is left to filter; `v` then holds the visibility. Else `search` is the half-width (uv) of the
// window to search, and `nearest` the least depth in it.
bool searched(ivec2 pixel, AreaLight a, out SoftReceiver r, out vec2 search, out float nearest, out float v) {
  if (softReceiver(pixel, a, push.normal_offset, 0.0, r, v)) return true;
  search = max(searchWindow(hsm, r, a, NEAREST_BLOCKER), NARROWEST_SEARCH / vec2(view.map_size));
  if (CLASSIFIED) {
    int found = classify(hsm, blocks, r, search, 0.5);
    v = float(found);
    if (found != HSM_PENUMBRA) return true;
  }
  ivec2 first, last;
  windowRange(r, search, 0.0, first, last);
  nearest = signedDepth(hsmBounds(hsm, first, last).x, push.range);
  return false;
}

#endif
