// Edges with identities: the anchored crossing rule. A point's four surrounding texel centres are anchors whose light is
// known from the depth map. Along a walk that crosses no silhouette edge visibility cannot change: the point inherits
// that of every anchor it can reach so. Where edges cut it off from all four, the edges themselves are the evidence.
#ifndef EDGESHADE_EDGE_RULE
#define EDGESHADE_EDGE_RULE
#include "lib/edge_segment.glsl"
#include "lib/shadow_test.glsl"

layout(constant_id = 0) const int K = 2;              // slots a texel
layout(constant_id = 1) const bool MIXED_ONLY = false; // ask the edges only where the four anchors disagree

layout(binding = 3) uniform sampler2DArray shadow_map;
layout(binding = 6, scalar) readonly buffer Keys { uvec2 keys[]; }; // segment, squared distance
layout(binding = 7, scalar) readonly buffer Segments { EdgeSegment segments[]; };

const uint EMPTY = 0xFFFFFFFFu;
// Rasterisation snaps vertices to 1/256 of a texel: this close to an edge an anchor's depth may be the other side's.
const float SNAPPED = 1.0 / 128.0;
// How the point was decided, for viewing.
const float BY_ANCHORS = 0.0, BY_EVIDENCE = 1.0, BY_NEAREST = 2.0;

struct EdgePoint {
  vec2 texels;     // place in the map, texels
  float depth;
  vec2 plane;      // depth over a texel, along the receiver
  float tolerance; // depth within which an edge may lie on the receiver itself
  float slack;     // depth a texel of distance that a curved receiver may lie before its plane
};

struct Anchors {
  ivec2 first;   // texel of the first anchor
  bvec4 usable;  // (0, 0), (1, 0), (0, 1), (1, 1)
  bvec4 lit;
};

ivec2 anchorTexel(ivec2 first, int k) { return first + ivec2(k & 1, k >> 1); }
vec2 anchorCenter(ivec2 first, int k) { return vec2(anchorTexel(first, k)) + 0.5; }
float planeDepth(EdgePoint p, vec2 at) {
  precise float z = p.depth + dot(p.plane, at - p.texels);
  return z;
}

Anchors anchorsOf(EdgePoint p, ivec2 map_size) {
  Anchors a;
  a.first = ivec2(floor(p.texels - 0.5));
  vec4 g = textureGather(shadow_map, vec3(vec2(a.first + 1) / vec2(map_size), 0.0));
  vec4 stored = g.wzxy;
  for (int k = 0; k < 4; ++k) {
    ivec2 t = anchorTexel(a.first, k);
    a.usable[k] = all(greaterThanEqual(t, ivec2(0))) && all(lessThan(t, map_size));
    vec2 c = anchorCenter(a.first, k);
    float z = planeDepth(p, c) - p.tolerance - p.slack * distance(c, p.texels);
    a.lit[k] = !a.usable[k] || shadowTest(z, stored[k]) != 0.0;
  }
  return a;
}

bool anyEdge(Anchors a, ivec2 map_size) {
  uint nearest = EMPTY;
  for (int k = 0; k < 4; ++k) {
    ivec2 t = clamp(anchorTexel(a.first, k), ivec2(0), map_size - 1);
    nearest = min(nearest, keys[uint(K) * (uint(t.y) * uint(map_size.x) + uint(t.x))].y);
  }
  return nearest != EMPTY;
}

bool isUnanimous(Anchors a) { return all(a.lit) || !any(a.lit); }

// Visibility by the edges around the point; `border` the distance in texels from the edge that decides, positive in shadow.
bool litByEdges(EdgePoint p, Anchors a, ivec2 map_size, float radius, out float border, out float how) {
  bvec4 open = a.usable;
  vec4 first_crossing = vec4(2.0);
  bvec4 crossed_inside = bvec4(false);
  float nearest = 3.0e38, nearest_line = 0.0;
  vec2 of_side = vec2(3.0e38); // nearest edge with the point outside of it, and inside
  for (int i = 0; i < 4 * K; ++i) {
    ivec2 t = anchorTexel(a.first, i / K);
    if (any(lessThan(t, ivec2(0))) || any(greaterThanEqual(t, map_size))) continue;
    uvec2 key = keys[uint(K) * (uint(t.y) * uint(map_size.x) + uint(t.x)) + uint(i % K)];
    if (key.y == EMPTY) continue;
    EdgeSegment e = segments[key.x];
    float foot = segmentFoot(e, p.texels);
    vec2 at = e.a + foot * (e.b - e.a);
    // Behind the receiver nothing can shadow it; on it, an edge is the receiver's own, or that of what stands on it.
    float over = planeDepth(p, at) - segmentDepth(e, foot);
    bool casts = over > p.tolerance;
    float line = lineDistance(e, p.texels), d2 = segmentDistance2(e, p.texels);
    if (casts && (d2 < nearest - 1e-9 || (d2 <= nearest + 1e-9 && abs(line) > abs(nearest_line)))) {
      nearest = min(d2, nearest);
      nearest_line = line;
    }
    if (casts) {
      if (line > 0.0) of_side.y = min(of_side.y, d2);
      else of_side.x = min(of_side.x, d2);
    }
    for (int k = 0; k < 4; ++k) {
      vec2 c = anchorCenter(a.first, k);
      if (segmentDistance2(e, c) < SNAPPED * SNAPPED) open[k] = false;
      float s;
      if (!crosses(e, p.texels, c, s)) continue;
      vec2 x = p.texels + s * (c - p.texels);
      float above = planeDepth(p, x) - segmentDepth(e, segmentFoot(e, x));
      if (above < -p.tolerance) continue;
      open[k] = false;
      if (above > p.tolerance && s < first_crossing[k]) {
        first_crossing[k] = s;
        crossed_inside[k] = line > 0.0;
      }
    }
  }
  bool some_lit = any(bvec4(open.x && a.lit.x, open.y && a.lit.y, open.z && a.lit.z, open.w && a.lit.w));
  bool some_dark = any(bvec4(open.x && !a.lit.x, open.y && !a.lit.y, open.z && !a.lit.z, open.w && !a.lit.w));
  bool lit;
  if (some_lit != some_dark) {
    how = BY_ANCHORS;
    lit = some_lit;
  } else if (some_lit) {
    // A border that is no edge of a mesh, or one that found no slot.
    how = BY_NEAREST;
    float best = 3.0e38;
    for (int k = 0; k < 4; ++k) {
      float d = distance(anchorCenter(a.first, k), p.texels);
      if (!open[k] || d >= best) continue;
      best = d;
      lit = a.lit[k];
    }
  } else {
    // Inside an edge there is always surface of the occluder; being outside of one edge proves nothing.
    how = BY_EVIDENCE;
    lit = !(nearest_line > 0.0 || any(crossed_inside));
  }
  float d = sqrt(lit ? of_side.x : of_side.y);
  border = min(d, radius) * (lit ? -1.0 : 1.0);
  return lit;
}

#endif
