#version 460
// Soft shadows: the layers over a receiver towards the light's centre, counted among its cell's triangles, and the
// silhouette edges of its cell that the receiver sees on the light, each of which changes the count on one side of it.
// Pixels of cells whose lists found no room are listed for soft_auto.comp.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "common/receiver.glsl"
#include "grid.glsl"
#include "grid_receiver.glsl"
#include "grid_layers.glsl"
#include "grid_edge.glsl"
#include "light_bits.glsl"
#include "common/pixel_steps.glsl"

layout(constant_id = 0) const bool MASKED = false; // there are casters that have no triangles here
layout(constant_id = 1) const bool DISC = false;   // shape of the light; false: square

layout(binding = 10, scalar) readonly buffer EdgeHeader { ListHeader edge_header; };
layout(binding = 11, scalar) readonly buffer EdgeStarts { uint edge_starts[]; };
layout(binding = 12, scalar) readonly buffer EdgeEntries { ListEntry edge_entries[]; };
layout(binding = 13, scalar) readonly buffer GridEdges { GridEdge grid_edges[]; };
layout(binding = 14, scalar) readonly buffer Receivers { vec3 receivers[]; };
layout(binding = 15) uniform sampler2D masked_visibility; // read only if MASKED
layout(binding = 16, scalar) readonly buffer FacePlanes { vec4 face_planes[]; };
layout(binding = 17, scalar) buffer FallbackList {
  uint groups[3];
  uint count;
  uint tiles;
  uint pixels[];
} fallback;

// False for a cell whose triangles or edges found no room.
bool hasCasters(uint cell) {
  return hasTriangles(cell) && edge_starts[cell + 1] <= push.entries &&
         (edge_header.lost == 0 || !isLost(edge_header.lost_blocks, cell));
}

// The receiver's plane: change of depth per ndc.
vec2 planeSlope(Receiver r, GridReceiver g) {
  vec2 uv_slope = receiverPlane(view.light_clip_from_view[0], view.light_depth_scale[0], g.point, r.normal);
  float scale = view.light_depth_scale[0]; // 0 for a sun
  return 0.5 * uv_slope / max(scale, float(push.spot == 0));
}

// Tests whether the receiver lies on the same side of a face's plane as the light's centre.
bool isBesideLight(vec4 plane, GridReceiver g) {
  precise float side = plane.x * g.ndc.x + plane.y * g.ndc.y + plane.z + plane.w * g.depth;
  return side > 0.0;
}

// An edge as the receiver sees it.
struct SeenEdge {
  vec2 away_a, away_b;   // ends, from the receiver: ndc
  float above_a, above_b; // and depth, positive towards the light
  vec2 whole; // the part within the square around the light: a range from 0 at a to 1 at b
  vec2 range; // and above the receiver's plane
};

// Returns false for an edge of which no part lies within the square around the light and above the receiver's plane.
// Beyond the square, its ends may be arbitrarily far away.
bool seeEdge(GridEdge e, GridReceiver g, vec2 slope, out SeenEdge s) {
  s.away_a = e.a.xy - g.ndc;
  s.away_b = e.b.xy - g.ndc;
  s.above_a = g.depth - e.a.z;
  s.above_b = g.depth - e.b.z;
  s.whole = vec2(0.0, 1.0);
  vec2 wide_a = push.kappa * s.above_a, wide_b = push.kappa * s.above_b;
  bool inside = cutRange(vec4(wide_a - s.away_a, wide_a + s.away_a), vec4(wide_b - s.away_b, wide_b + s.away_b), s.whole);
  s.range = s.whole;
  float least = 1e-6 * abs(g.depth);
  cutRange(s.above_a - least, s.above_b - least, s.range);
  cutRange(s.above_a + dot(slope, s.away_a), s.above_b + dot(slope, s.away_b), s.range);
  return inside && s.range.x < s.range.y;
}

// The ends of the part of an edge, on the light.
void endsOnLight(SeenEdge s, out vec2 from, out vec2 to) {
  vec2 along = s.away_b - s.away_a;
  float rise = s.above_b - s.above_a;
  // Places between are computed from the end that is nearer to the receiver: the other one may be at the light.
  bool from_b = s.above_b < s.above_a;
  vec3 base = from_b ? vec3(s.away_b, s.above_b) : vec3(s.away_a, s.above_a);
  vec2 t = from_b ? s.range - 1.0 : s.range;
  precise vec2 first = (base.xy + t.x * along) / (push.kappa * (base.z + t.x * rise));
  precise vec2 last = (base.xy + t.y * along) / (push.kappa * (base.z + t.y * rise));
  precise vec2 at_a = s.away_a / (push.kappa * s.above_a);
  precise vec2 at_b = s.away_b / (push.kappa * s.above_b);
  from = ontoRows(s.range.x > 0.0 ? first : at_a, DISC);
  to = ontoRows(s.range.y < 1.0 ? last : at_b, DISC);
}

// Share of the light that the receiver sees.
float lightSeen(Receiver r, GridReceiver g, uint cell) {
  vec2 slope = planeSlope(r, g), tilt = slope * push.kappa;
  LightBits bits = noLayers();
  bool partly = reachesBelow(tilt);
  uint changes = 0;
  // Where the horizon cuts an edge, the boundary of the layer follows it. All cuts follow it to the same end, so that
  // their ways beyond the layer cancel out.
  vec2 along_horizon = ontoRows(vec2(-tilt.y, tilt.x) * (8.0 / max(length(tilt), 1e-30)), DISC);
  uint end = edge_starts[cell + 1];
  SeenEdge s;
  uvec3 place = boundedPlace(g.ndc, g.depth);
  for (uint block = edge_starts[cell]; block < end; block += 32) {
    // Few of the edges count. They are found first, so that threads of a subgroup work on theirs together.
    uint counted = 0, size = min(32, end - block);
    uint found = 0;
    for (uint i = 0; i < size; ++i) found |= uint(isBounded(place, edge_entries[block + i].bounds)) << i;
    while (found != 0) {
      int i = findLSB(found);
      found &= found - 1;
      counted |= uint(seeEdge(grid_edges[edge_entries[block + uint(i)].caster], g, slope, s)) << i;
    }
    partly = partly || counted != 0;
    bool after_from = false, after_to = false; // the way along the horizon before or after the edge is next
    while (counted != 0) {
      uint edge = edge_entries[block + uint(findLSB(counted))].caster;
      GridEdge e = grid_edges[edge];
      seeEdge(e, g, slope, s);
      vec2 from, to;
      endsOnLight(s, from, to);
      vec2 first = after_from ? from + along_horizon : after_to ? to : from;
      vec2 last = after_from ? from : after_to ? to + along_horizon : to;
      // The sides of a face whose plane cuts the light count on one side of the plane only.
      bool counts = edge < push.silhouettes || isBesideLight(face_planes[(edge - push.silhouettes) / 3], g);
      int weight = counts ? e.weight : 0;
      addEdge(bits, first, last, weight, DISC);
      changes += uint(weight);
      bool is_edge = !after_from && !after_to;
      after_to = s.range.y < s.whole.y && (after_from || is_edge && s.range.x == s.whole.x);
      after_from = s.range.x > s.whole.x && is_edge;
      if (!after_from && !after_to) counted &= counted - 1;
    }
  }
  uint layers = layersOver(vec3(g.ndc, g.depth), cell, partly);
  if (!partly) return layers == 0 ? 1.0 : 0.0;
  // The counters count modulo 256.
  return layers > changes ? 0.0 : lightVisible(bits, layers, tilt, DISC);
}

// The lower of a visibility and that of masked casters.
float withMasked(ivec2 pixel, float v) { return MASKED ? min(v, texelFetch(masked_visibility, pixel, 0).x) : v; }

// Visibility of a pixel, from its depth and normal on. Returns false if the pixel's cell has no lists.
bool visibilityAt(ivec2 pixel, out float v) {
  Receiver r = receiverAt(pixel);
  GridReceiver g;
  if (gridReceiver(pixel, r, g, v)) return true;
  uint cell = cellOf(g.ndc);
  if (!hasCasters(cell)) return false;
  v = withMasked(pixel, lightSeen(r, g, cell));
  return true;
}

void decide(ivec2 pixel) {
  float v;
  if (visibilityAt(pixel, v)) imageStore(visibility, pixel, vec4(v));
  else APPEND_PIXEL_OF(fallback, pixel, 1)
}

// Number of listed pixels that a thread works on one after the other. Mesa's CPU driver ends all loops of a thread after
// 65535 rounds. A triangle takes up to 3; an edge, with its ways along the horizon, up to 18.
uint pixelsTogether() {
  uint rounds = 3 * min(header.longest, 20000) + 18 * min(edge_header.longest, 20000) + 1;
  return clamp(60000 / rounds, 1, TOGETHER);
}

void main() {
  if (readsList()) {
    for (uint i = firstListed(); i < list.count; i += listStride()) {
      decide(unpackTile(list.pixels[i]));
    }
    return;
  }
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  bool inside = all(lessThan(pixel, ivec2(view.size))), listed = false;
  if (inside && STEP == LIST) {
    vec3 r = receivers[uint(pixel.y) * view.size.x + uint(pixel.x)];
    if (r != NO_RECEIVER) {
      uint cell = cellOf(r.xy);
      bool has_lists = hasCasters(cell);
      if (!has_lists) APPEND_PIXEL_OF(fallback, pixel, 1)
      listed = has_lists && edge_starts[cell] != edge_starts[cell + 1];
      if (has_lists && !listed) imageStore(visibility, pixel, vec4(withMasked(pixel, layersOver(r, cell, false) == 0 ? 1.0 : 0.0)));
    }
  } else if (inside) {
    decide(pixel);
  }
  [[dont_unroll]] for (; listed; listed = false) APPEND_PIXEL_OF(list, pixel, pixelsTogether())
}
