#version 460
// Soft shadows: the layers over a receiver towards the light's centre, counted among its cell's triangles, and the
// silhouette edges of its cell that the receiver sees on the light, each of which changes the count on one side of it.
// Pixels of cells whose lists found no room are listed for soft_auto.comp.
#extension GL_GOOGLE_include_directive : require
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
layout(binding = 12, scalar) readonly buffer EdgeEntries { uint edge_entries[]; };
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

// Share of the light that the receiver sees.
float lightSeen(Receiver r, GridReceiver g, uint cell) {
  vec2 slope = planeSlope(r, g), tilt = slope * push.kappa;
  LightBits bits = noLayers();
  bool partly = reachesBelow(tilt);
  uint changes = 0;
  float least = 1e-6 * abs(g.depth);
  for (uint i = edge_starts[cell]; i < edge_starts[cell + 1]; ++i) {
    uint edge = edge_entries[i];
    GridEdge e = grid_edges[edge];
    vec2 away_a = e.a.xy - g.ndc, away_b = e.b.xy - g.ndc;
    float above_a = g.depth - e.a.z, above_b = g.depth - e.b.z;
    // The part of the edge within the square around the light. Beyond, its ends may be arbitrarily far away.
    vec2 range = vec2(0.0, 1.0), wide_a = push.kappa * above_a, wide_b = push.kappa * above_b;
    if (!cutRange(vec4(wide_a - away_a, wide_a + away_a), vec4(wide_b - away_b, wide_b + away_b), range)) continue;
    // The part nearer to the light than the receiver, and above the receiver's plane.
    cutRange(above_a - least, above_b - least, range);
    cutRange(above_a + dot(slope, away_a), above_b + dot(slope, away_b), range);
    if (!(range.x < range.y)) continue;
    partly = true;
    // The sides of a face whose plane cuts the light count on one side of the plane only.
    if (edge >= push.silhouettes && !isBesideLight(face_planes[(edge - push.silhouettes) / 3], g)) continue;
    vec2 along = away_b - away_a;
    float rise = above_b - above_a;
    precise vec2 from = (away_a + range.x * along) / (push.kappa * (above_a + range.x * rise));
    precise vec2 to = range.y < 1.0 ? (away_a + range.y * along) / (push.kappa * (above_a + range.y * rise))
                                    : away_b / (push.kappa * above_b);
    addEdge(bits, ontoRows(from, DISC), ontoRows(to, DISC), e.weight, DISC);
    changes += uint(e.weight);
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
  else APPEND_PIXEL(fallback, pixel)
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
      if (!has_lists) APPEND_PIXEL(fallback, pixel)
      listed = has_lists && edge_starts[cell] != edge_starts[cell + 1];
      if (has_lists && !listed) imageStore(visibility, pixel, vec4(withMasked(pixel, layersOver(r, cell, false) == 0 ? 1.0 : 0.0)));
    }
  } else if (inside) {
    decide(pixel);
  }
  listPixel(pixel, listed);
}
