// Hierarchical shadow map: Guennebaud, Barthe, Paulin, "Real-time soft shadow mapping by backprojection" (2006). The
// classes are those of Macedo, Apolinario, Aguero (2019), eq. 8, made conservative. hsm.comp builds the image.
// Include after common/soft_receiver.glsl and common/pcf_bounds.glsl.
#ifndef EDGESHADE_HSM
#define EDGESHADE_HSM
#extension GL_EXT_control_flow_attributes : require

const int HSM_UMBRA = 0, HSM_LIT = 1, HSM_PENUMBRA = -1;

// Minimum and maximum of the stored depths over the texels `first` to `last`, both included. The bounds are
// conservative: they cover a window that is wider by less than one pyramid entry on each side. Such an entry is between a
// quarter of the window's wider side and all of it. Outside the map all depths are 1.
vec2 hsmBounds(sampler2D hsm, ivec2 first, ivec2 last) {
  ivec2 map_last = ivec2(view.map_size) - 1;
  bool leaves = any(lessThan(first, ivec2(0))) || any(greaterThan(last, map_last));
  ivec2 a = clamp(first, ivec2(0), map_last), b = clamp(last, ivec2(0), map_last);
  // The finest level at which the window touches at most 4 entries along each axis; an entry of level l has 2^(l+1) texels.
  int wider = max(b.x - a.x, b.y - a.y);
  int shift = max(findMSB(wider) - 1, 1);
  if (any(greaterThan((b >> shift) - (a >> shift), ivec2(3)))) ++shift;
  a >>= shift;
  b >>= shift;
  vec2 bounds = leaves ? vec2(1.0, 1.0) : vec2(1.0, 0.0);
  for (int y = a.y; y <= b.y; ++y) {
    for (int x = a.x; x <= b.x; ++x) {
      vec2 entry = texelFetch(hsm, ivec2(x, y), shift - 1).xy;
      bounds = vec2(min(bounds.x, entry.x), max(bounds.y, entry.y));
    }
  }
  return bounds;
}

// Range of the texels that taps within a half-width (uv) can touch, including the rounding of the taps' places.
void windowRange(SoftReceiver r, vec2 half_width, float margin, out ivec2 first, out ivec2 last) {
  precise vec2 reach = windowTexels(half_width) * 1.00001 + (margin + 0.01);
  precise vec2 low = floor(r.at - reach), high = floor(r.at + reach);
  first = ivec2(low);
  last = ivec2(high);
}

// Classifies the texels `first` to `last` by the bounds of their depths: HSM_LIT or HSM_UMBRA if all of them are certainly
// lit or certainly shadowed; otherwise HSM_PENUMBRA. Every texel is compared with the receiver's plane at its centre, or
// with planes that lie nearer to the light by up to `drop`.
int classifyBounds(SoftReceiver r, vec2 bounds, ivec2 first, ivec2 last, float drop) {
  // The receiver's plane over the window: its depth in the middle, and its rise from there to a corner.
  vec2 middle = 0.5 * vec2(first + last) + 0.5 - r.at, reach = 0.5 * vec2(last - first);
  float depth = r.map.depth + dot(r.slope, middle);
  float rise = dot(abs(r.slope), reach);
  // The taps sum their references in another order, so the bound allows for the difference in rounding.
  float rounding = 2.5e-7 + 5e-7 * dot(abs(r.slope), reach + abs(middle));
  // An empty texel never shadows, whatever the reference.
  if (min(depth + rise + rounding, 1.0) <= bounds.x) return HSM_LIT;
  return bounds.y < 1.0 && depth - drop - rise - rounding > bounds.y ? HSM_UMBRA : HSM_PENUMBRA;
}

// The same by the depth bounds of blocks (depth_bounds.comp), whose slopes decide tilted receivers: their own depth varies
// too much over the window for a plain minimum and maximum.
int classifyBlocks(sampler2D blocks, SoftReceiver r, ivec2 first, ivec2 last, float drop) {
  ivec2 size = last - first;
  int wider = max(size.x, size.y);
  bool inside = all(greaterThanEqual(first, ivec2(0))) && all(lessThan(last, ivec2(view.map_size)));
  // The window touches at most 4 x 4 blocks. Wider windows stay undecided.
  if (!inside || wider >= 192) return HSM_PENUMBRA;
  int level = wider < 24 ? 0 : wider < 48 ? 1 : wider < 96 ? 2 : 3;
  vec2 away = vec2(first) + 0.5 - r.at;
  float rounding = 2.5e-7 + 5e-7 * dot(abs(r.slope), abs(away) + vec2(size));
  return decideBlocks(blocks, level, first, last, r.map.depth + dot(r.slope, away), r.slope, drop, rounding);
}

// Classifies a window by the pyramid, and by blocks if that does not decide it. The window holds all texels that taps within
// `half_width` (uv) can touch, and those up to `margin` texels around them. If these are all texels that a technique reads,
// the class decides the technique's result: 1 or 0.
int classify(sampler2D hsm, sampler2D blocks, SoftReceiver r, vec2 half_width, float margin) {
  ivec2 first, last;
  windowRange(r, half_width, margin, first, last);
  int found = classifyBounds(r, hsmBounds(hsm, first, last), first, last, 0.0);
  return found != HSM_PENUMBRA ? found : classifyBlocks(blocks, r, first, last, 0.0);
}

// Half-width (uv) of the window to search for blockers. The papers' window reaches up to the near plane. With
// `nearest_blocker` the smallest depth in that window limits how near to the light a blocker can be, which gives a
// smaller window; this is repeated once for the smaller window. The taps then lie denser, and every blocker stays in
// reach. `reach` is the half-width of the filter to come in penumbra half-widths, at least 1; the window grows by this
// factor.
vec2 searchWindow(sampler2D hsm, SoftReceiver r, AreaLight a, bool nearest_blocker, float reach) {
  precise vec2 half_width = searchHalfWidth(a, r.z, a.near) * reach;
  for (int i = 0; i < (nearest_blocker ? 2 : 0); ++i) {
    ivec2 first, last;
    windowRange(r, half_width, 0.0, first, last);
    float nearest = lightDistance(a, hsmBounds(hsm, first, last).x);
    half_width = searchHalfWidth(a, r.z, max(nearest, a.near)) * reach;
  }
  return half_width;
}

// The search window for a filter as wide as the penumbra.
vec2 searchWindow(sampler2D hsm, SoftReceiver r, AreaLight a, bool nearest_blocker) {
  return searchWindow(hsm, r, a, nearest_blocker, 1.0);
}

// The same window, and in `found` its class if a wider window on the way decides it: one that covers the window, if that has
// at least the half-width `least` (uv), and `margin` texels around it. The window is undefined then.
vec2 searchWindow(sampler2D hsm, SoftReceiver r, AreaLight a, bool nearest_blocker, float reach, vec2 least, float margin, out int found) {
  found = HSM_PENUMBRA;
  precise vec2 half_width = searchHalfWidth(a, r.z, a.near) * reach;
  int rounds = nearest_blocker ? 2 : 0;
  [[dont_unroll]] for (int i = 0; i < rounds && found == HSM_PENUMBRA; ++i) {
    ivec2 first, last;
    windowRange(r, half_width, 0.0, first, last);
    vec2 bounds = hsmBounds(hsm, first, last), read = windowTexels(half_width);
    half_width = searchHalfWidth(a, r.z, max(lightDistance(a, bounds.x), a.near)) * reach;
    bool covers = all(greaterThanEqual(read, windowTexels(max(half_width, least)) + (margin + 0.02)));
    if (covers) found = classifyBounds(r, bounds, first, last, 0.0);
  }
  return max(half_width, least);
}

#endif
