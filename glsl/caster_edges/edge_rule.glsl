// Hard shadows from edges with identities, by the anchored crossing rule. The anchors of a point are the four texel
// centres around it, the corners of its cell in the map of edges (edge_map.glsl); the depth map gives their visibility.
// Along a walk that crosses no silhouette edge visibility cannot change, so the point takes over the visibility of
// every anchor that it can reach this way. If edges separate it from all four, the edges themselves are the evidence.
// A shadow ends without an edge where a surface enters the receiver; the triangles beside the edges decide there.
#ifndef EDGESHADE_EDGE_RULE
#define EDGESHADE_EDGE_RULE
#include "lib/edge_segment.glsl"
#include "lib/shadow_test.glsl"
#include "edge_cells.glsl"

layout(constant_id = 0) const int K = 2;               // slots per cell
layout(constant_id = 5) const bool SPLIT = false;      // a second buffer holds the slots of the map's lower half
layout(constant_id = 6) const bool SOFT = false;       // also compute the distance to the border
layout(constant_id = 1) const bool MIXED_ONLY = false; // use the edges only where the four anchors disagree

layout(binding = 3) uniform sampler2DArray shadow_map;
layout(binding = 6, scalar) readonly buffer Keys { uvec2 keys[]; }; // segment, squared distance
layout(binding = 10, scalar) readonly buffer LowerKeys { uvec2 lower_keys[]; };
layout(binding = 7, scalar) readonly buffer Segments { EdgeSegment segments[]; };
layout(binding = 8, scalar) readonly buffer Spill {
  uint lost;
  uint count;
  SpilledEdge entries[];
} spill;
layout(binding = 9, scalar) readonly buffer Heads { uvec2 heads[]; };

const uint EMPTY = 0xFFFFFFFFu;
// Rasterisation snaps vertices to 1/256 of a texel. An anchor this close to an edge may hold the depth of the other
// side.
const float SNAPPED = 1.0 / 128.0;
// The way in which a point was decided, for pictures.
const float BY_ANCHORS = 0.0, BY_EVIDENCE = 1.0, BY_CONTACT = 2.0, BY_NEAREST = 3.0, BY_FACE = 4.0;
// A face is extended beyond its triangle while it lies at most this many tolerances in front of the receiver. A face
// farther in front must have ended in between.
const float FOLLOWED = 32.0;
// Distance beyond an edge, texels, at which the map tells whether light arrives; more than half a texel's diagonal.
const float BEYOND = 0.75;

struct EdgePoint {
  vec2 texels;     // place in the map, texels
  float depth;
  vec2 plane;      // change of the receiver plane's depth per texel
  float tolerance; // an edge this close to the receiver's depth may lie on the receiver
  float bias;      // subtracted from the receiver's depth at an anchor
  float slack;     // depth per texel of distance by which a curved receiver may lie in front of its plane
  float steepest;  // slope, in depth per texel, beyond which an occluder's surface is not followed
};

struct Anchors {
  ivec2 first;  // texel of the first anchor
  bvec4 usable; // order: (0, 0), (1, 0), (0, 1), (1, 1)
  bvec4 lit;
  bvec4 sure;   // lit even without the bias, or dark in spite of it
  vec4 stored;  // stored depth
};

ivec2 anchorTexel(ivec2 first, int k) { return first + ivec2(k & 1, k >> 1); }
vec2 anchorCenter(ivec2 first, int k) { return vec2(anchorTexel(first, k)) + 0.5; }


uvec2 keyAt(uint cell, int i, ivec2 map_size) {
  uint lower_from = lowerCells(map_size);
  bool lower = SPLIT && cell >= lower_from;
  uint slot = uint(K) * (lower ? cell - lower_from : cell) + uint(i);
  return lower ? lower_keys[slot] : keys[slot];
}

bool inMap(ivec2 t, ivec2 map_size) { return all(greaterThanEqual(t, ivec2(0))) && all(lessThan(t, map_size)); }

float planeDepth(EdgePoint p, vec2 at) {
  precise float z = p.depth + dot(p.plane, at - p.texels);
  return z;
}

// Depth of the receiver at an anchor, as near to the light as it may lie.
float referenceDepth(EdgePoint p, vec2 at) { return planeDepth(p, at) - p.bias - p.slack * distance(at, p.texels); }

Anchors anchorsOf(EdgePoint p, ivec2 map_size) {
  Anchors a;
  a.first = ivec2(floor(p.texels - 0.5));
  a.stored = textureGather(shadow_map, vec3(vec2(a.first + 1) / vec2(map_size), 0.0)).wzxy;
  for (int k = 0; k < 4; ++k) {
    a.usable[k] = inMap(anchorTexel(a.first, k), map_size);
    vec2 c = anchorCenter(a.first, k);
    a.lit[k] = !a.usable[k] || shadowTest(referenceDepth(p, c), a.stored[k]) != 0.0;
    a.sure[k] = !a.lit[k] || shadowTest(planeDepth(p, c) - p.tolerance, a.stored[k]) != 0.0;
  }
  return a;
}

bool anyEdge(Anchors a, ivec2 map_size) {
  ivec2 cell = a.first + 1;
  return isCell(cell, map_size) && keyAt(cellIndex(cell, map_size), 0, map_size).y != EMPTY;
}

bvec4 both(bvec4 a, bvec4 b) { return bvec4(a.x && b.x, a.y && b.y, a.z && b.z, a.w && b.w); }

int countOf(bvec4 b) { return int(b.x) + int(b.y) + int(b.z) + int(b.w); }

bool isUnanimous(Anchors a) { return all(a.lit) || !any(a.lit); }

// Findings about the edges around a point so far.
struct Evidence {
  bvec4 open;          // anchors that the point can reach
  bvec4 likely;        // those, and anchors that only hidden edges separate from it
  bvec4 settled;       // anchors that no edge passes too closely
  ivec4 layers;        // layers of casters in front of the receiver, at the point minus at each anchor, by the edges between
  vec4 first_crossing; // parameter of the first crossing on the walk to each anchor
  bvec4 from_inside;   // the point is on the occluder's side of that edge
  bvec4 under_first;   // the extended face beside that edge lies in front of the point
  float nearest;       // squared distance of the nearest edge in front of the receiver
  float nearest_line;  // signed distance from its line
  bool under_nearest;  // the point is inside this edge, and its extended face lies in front of the point
  bool covered;        // the triangle beside an edge lies in front of the point
  vec2 of_side;        // squared distances of the nearest edge with the point outside, and of the nearest with it inside
};

// Tests whether a shadow ends at an edge that the point is inside of. It does if the map sees the receiver beyond the
// edge's nearest place.
bool litBeyond(EdgeSegment e, float foot, EdgePoint p, ivec2 map_size) {
  vec2 place = e.a + foot * (e.b - e.a), away = place - p.texels, d = e.b - e.a;
  float far = length(away);
  vec2 outwards = far > 1e-3 ? away / far : vec2(d.y, -d.x) / length(d);
  ivec2 t = ivec2(floor(place + BEYOND * outwards));
  return !inMap(t, map_size) ||
         shadowTest(referenceDepth(p, vec2(t) + 0.5), shadowMapDepth(shadow_map, t, 0, map_size)) != 0.0;
}

void consider(EdgeSegment e, EdgePoint p, Anchors a, ivec2 map_size, inout Evidence v) {
  float foot = segmentFoot(e, p.texels);
  // Only an edge in front of the receiver can shadow it. An edge on the receiver is the receiver's own, or belongs to
  // an object that stands on it. It separates anchors, but proves no shadow.
  bool casts = planeDepth(p, e.a + foot * (e.b - e.a)) - segmentDepth(e, foot) > p.tolerance;
  float line = lineDistance(e, p.texels), d2 = segmentDistance2(e, p.texels), face;
  bool in_face = faceCovers(e, p.texels, face);
  float before = p.depth - face;
  if (in_face && before > p.tolerance) v.covered = true;
  bool under = line > 0.0 && (e.flags & SEGMENT_FACE) != 0 && before > p.tolerance && before < FOLLOWED * p.tolerance;
  if (casts) {
    // If two edges share the nearest vertex, the one whose line is farther decides the side. If two edges lie in the
    // same place, the one with the point inside decides. So their order does not matter.
    bool farther_line = abs(line) > abs(v.nearest_line) || abs(line) == abs(v.nearest_line) && line > 0.0;
    if (d2 < v.nearest || d2 == v.nearest && farther_line) {
      v.nearest = d2;
      v.nearest_line = line;
      v.under_nearest = false;
    }
    if (d2 == v.nearest && line == v.nearest_line && under) v.under_nearest = true;
    if (line <= 0.0) v.of_side.x = min(v.of_side.x, d2);
    else if (SOFT && d2 < v.of_side.y && litBeyond(e, foot, p, map_size)) v.of_side.y = d2;
  }
  for (int k = 0; k < 4; ++k) {
    vec2 c = anchorCenter(a.first, k);
    if (segmentDistance2(e, c) < SNAPPED * SNAPPED) v.open[k] = v.settled[k] = false;
    float s;
    bool crossed = crosses(e, p.texels, c, s);
    vec2 x = p.texels + s * (c - p.texels);
    float depth = segmentDepth(e, segmentFoot(e, x)), above = planeDepth(p, x) - depth;
    crossed = crossed && above >= -p.tolerance;
    // An edge far behind the surface that the anchor sees is hidden there, so crossing it changes nothing. If the edge
    // lies in front of the receiver, this is only likely.
    bool hidden = !a.lit[k] && depth - a.stored[k] > p.steepest * distance(x, c) + p.tolerance;
    if (crossed && !(hidden && above <= p.tolerance)) v.open[k] = false;
    if (crossed && !hidden) v.likely[k] = false;
    bool counts = crossed && !hidden && above > p.tolerance;
    if (counts) v.layers[k] += line > 0.0 ? 1 : -1;
    if (counts && s <= v.first_crossing[k]) {
      bool tie = s == v.first_crossing[k];
      v.from_inside[k] = line > 0.0 || tie && v.from_inside[k];
      v.under_first[k] = under || tie && v.under_first[k];
      v.first_crossing[k] = s;
    }
  }
}

// Depth of the surface that an anchor sees, extrapolated to another place by the step from the texel beyond, along each
// axis.
float continuedDepth(ivec2 first, int k, vec2 at, ivec2 map_size) {
  ivec2 t = anchorTexel(first, k), out_x = ivec2((k & 1) * 2 - 1, 0), out_y = ivec2(0, (k >> 1) * 2 - 1);
  float z = shadowMapDepth(shadow_map, t, 0, map_size);
  vec2 beyond = vec2(shadowMapDepth(shadow_map, t + out_x, 0, map_size), shadowMapDepth(shadow_map, t + out_y, 0, map_size));
  vec2 slope = (beyond - z) * vec2(out_x.x, out_y.y);
  return z + dot(slope, at - anchorCenter(first, k));
}

// Decides between reachable anchors that disagree: the border between them is not an edge. Where a surface enters the
// receiver, its extrapolated depth locates the border; `contact` is then true. Otherwise the nearest anchor decides, as
// on any shadow map.
bool litByAnchors(EdgePoint p, Anchors a, bvec4 open, ivec2 map_size, out bool contact) {
  float nearest_lit = 3.0e38, nearest_dark = 3.0e38;
  int lit = 0, dark = 0;
  for (int k = 0; k < 4; ++k) {
    float d = distance(anchorCenter(a.first, k), p.texels);
    if (!open[k]) continue;
    if (a.lit[k] && d < nearest_lit) {
      nearest_lit = d;
      lit = k;
    }
    if (!a.lit[k] && d < nearest_dark) {
      nearest_dark = d;
      dark = k;
    }
  }
  vec2 there = anchorCenter(a.first, lit);
  contact = continuedDepth(a.first, dark, there, map_size) >= referenceDepth(p, there);
  if (!contact) return nearest_lit < nearest_dark;
  return continuedDepth(a.first, dark, p.texels, map_size) >= p.depth - p.tolerance;
}

// Visibility by the edges around the point. `border` is the distance in texels from the deciding edge, positive in
// shadow.
bool litByEdges(EdgePoint p, Anchors a, ivec2 map_size, out float border, out float how) {
  Evidence v;
  v.open = v.likely = v.settled = a.usable;
  v.layers = ivec4(0);
  v.first_crossing = vec4(2.0);
  v.from_inside = v.under_first = bvec4(false);
  v.nearest = 3.0e38;
  v.nearest_line = 0.0;
  v.under_nearest = v.covered = false;
  v.of_side = vec2(3.0e38);
  uint cell = cellIndex(a.first + 1, map_size);
  bool full = isCell(a.first + 1, map_size);
  for (int i = 0; i < K; ++i) {
    uvec2 key = full ? keyAt(cell, i, map_size) : uvec2(EMPTY);
    full = key.y != EMPTY;
    if (full) consider(segments[key.x], p, a, map_size, v);
  }
  uint entry = full ? heads[cell].x : EMPTY;
  while (entry != EMPTY) {
    SpilledEdge s = spill.entries[entry];
    consider(segments[s.segment], p, a, map_size, v);
    entry = s.next;
  }
  bvec4 surely = both(v.open, a.sure);
  bool some_lit = any(both(v.open, a.lit)), some_dark = any(both(v.open, not(a.lit)));
  bool inside = v.nearest_line > 0.0 || any(v.from_inside);
  // A lit anchor sees a surface that nothing covers, so these layers begin on the way to the point.
  bool layered = any(both(both(v.settled, both(a.sure, a.lit)), greaterThan(v.layers, ivec4(0))));
  int leading_under = countOf(v.under_first) + (v.under_nearest ? 1 : 0);
  bool lit;
  if (v.covered) {
    how = BY_FACE;
    lit = false;
  } else if (some_dark && !some_lit || !some_dark && any(both(surely, a.lit))) {
    // If more edges lead under a face than reachable anchors are lit, a surface between them enters the receiver.
    how = BY_ANCHORS;
    lit = some_lit && leading_under <= countOf(both(v.open, a.lit));
  } else if (some_dark) {
    bool contact;
    lit = litByAnchors(p, a, v.open, map_size, contact);
    how = contact ? BY_CONTACT : BY_NEAREST;
  } else {
    // Inside an edge there is always a surface of the occluder. Being outside one edge proves nothing, and neither do
    // anchors that are lit only because of the bias.
    how = BY_EVIDENCE;
    lit = !inside && !layered && (some_lit || !any(both(v.likely, not(a.lit))));
  }
  float d = sqrt(lit ? v.of_side.x : v.of_side.y);
  border = lit ? -d : d;
  return lit;
}

#endif
