#version 460
// Revectorization-based soft shadow mapping: [CGF] Macedo, Apolinario, Aguero, "Revectorization-based soft shadow mapping"
// (2019), algorithms 2 and 3. Blockers are searched for, their mean distance gives the width of the penumbra, and
// revectorized visibility is averaged over that width. Pixels whose whole search window is lit or in shadow by the
// hierarchical shadow map need neither: the same image, bit for bit.
//
// A tap of the filter is a place in the map, not a texel: n x n of them lie at the centres of the window's cells, and each
// is lit or in shadow by the edge as it runs through its texel. So a window narrower than a texel sees the straightened
// edge, one without width is the hard technique, and taps that are several texels apart still find each the edge in
// their own texel, though they know nothing of the texels between.
#extension GL_GOOGLE_include_directive : require
layout(constant_id = 1) const int MAX_DISTANCE = 16;
#define MAXDIST MAX_DISTANCE
#include "rbsm_receiver.glsl"
#include "hsm.glsl"
#include "lib/rbsm_profile.glsl"
#include "lib/rbsm_star.glsl"
#include "pixel_steps.glsl"

layout(constant_id = 2) const int SEARCH_TAPS = 9;  // by axis
layout(constant_id = 3) const int FILTER_TAPS = 11; // by axis
const int RECOVERY = 0, STAR = 1, PROFILE = 2, TEST = 3, FILTERED = 4;
layout(constant_id = 5) const int FUNCTION = STAR;
layout(constant_id = 6) const bool NEAREST_BLOCKER = true; // search only as far as the nearest blocker allows
layout(constant_id = 7) const int COUNTED = 1;       // experiment

layout(binding = 6) uniform sampler2D hsm;    // hsm.comp; read if NEAREST_BLOCKER or STEP is LIST
layout(binding = 7) uniform sampler2D blocks; // depth_bounds.comp; read if STEP is LIST

struct Blockers {
  float z;   // mean linear distance
  int count;
};

void countBlocker(ShadowPoint p, AreaLight a, SoftReceiver r, ivec2 texel, vec2 away, vec2 cell, inout float sum, inout int count) {
  float stored = shadowMapDepth(shadow_map, texel, 0, ivec2(view.map_size));
  bool blocks = shadowTest(receiverDepth(p, texel), stored) == 0.0;
  float z = lightDistance(a, stored);
  if (COUNTED >= 1) {
    vec2 h = windowTexels(filterHalfWidth(a, r.z, z)) + cell;
    if (COUNTED == 2) h += 1.0;
    if (COUNTED == 3) h *= 1.5;
    blocks = blocks && all(lessThanEqual(abs(away), h));
  }
  sum += blocks ? z : 0.0;
  count += int(blocks);
}

Blockers searchBlockers(ShadowPoint p, SoftReceiver r, AreaLight a, vec2 half_texels) {
  precise float sum = 0.0;
  int count = 0;
  vec2 cell = half_texels / float(SEARCH_TAPS);
  for (int j = 0; j < SEARCH_TAPS; ++j) {
    for (int i = 0; i < SEARCH_TAPS; ++i) {
      precise vec2 away = ((2.0 * vec2(i, j) + 1.0) / float(SEARCH_TAPS) - 1.0) * half_texels;
      precise vec2 place = floor(r.at + away);
      countBlocker(p, a, r, ivec2(place), away, cell, sum, count);
    }
  }
  if (count == 0) {
    // The neighbourhood: an edge may reach into the point's texel from there.
    for (int i = 0; i < 9; ++i) countBlocker(p, a, r, p.texel + ivec2(i % 3, i / 3) - 1, vec2(0.0), cell, sum, count);
  }
  precise float z = sum / float(max(count, 1));
  return Blockers(z, count);
}

float revectorizedAt(ShadowPoint p, vec2 place) {
  vec2 first = floor(place);
  ShadowPoint q = p;
  q.texel = ivec2(first);
  q.fraction = clamp(place - first, vec2(1e-7), vec2(1.0 - 6e-8));
  vec4 N;
  float s = testNeighbourhood(q, N);
  vec3 d = packDiscontinuity(N, s);
  if (FUNCTION == TEST || d.x == 0.0 && d.y == 0.0 || FUNCTION == RECOVERY && s == 0.0) return s;
  if (FUNCTION == PROFILE) return revectorizeProfile(q, d, RUN_ONLY);
  if (FUNCTION == STAR) return revectorizeStar(q, d);
  return revectorizeShadowEdge(q, d, FUNCTION == RECOVERY);
}

float filterRevectorized(ShadowPoint p, SoftReceiver r, vec2 half_texels) {
  float lit = 0.0;
  for (int j = 0; j < FILTER_TAPS; ++j) {
    for (int i = 0; i < FILTER_TAPS; ++i) {
      precise vec2 place = r.at + ((2.0 * vec2(i, j) + 1.0) / float(FILTER_TAPS) - 1.0) * half_texels;
      lit += revectorizedAt(p, place);
    }
  }
  return lit == float(FILTER_TAPS * FILTER_TAPS) ? 1.0 : min(lit / float(FILTER_TAPS * FILTER_TAPS), 1.0);
}

bool visibilityAt(ivec2 pixel, out float v) {
  AreaLight a = areaLight();
  SoftReceiver r;
  if (softReceiver(pixel, a, push.normal_offset, push.depth_bias, r, v)) return true;
  precise vec2 search = searchWindow(hsm, r, a, NEAREST_BLOCKER);
  if (STEP == LIST) {
    int found = classify(hsm, blocks, r, search, 1.0);
    v = float(found);
    return found != HSM_PENUMBRA;
  }
  ShadowPoint p = shadowPoint(r.at, r.map.depth, r.slope, push.slack * r.map.texel_depth);
  Blockers b = searchBlockers(p, r, a, windowTexels(search));
  v = 1.0;
  // Rounding must not carry the filter out of what was searched and classified.
  if (b.count > 0) v = filterRevectorized(p, r, windowTexels(min(filterHalfWidth(a, r.z, b.z), search)));
  return true;
}
