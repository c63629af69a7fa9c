#version 460
// Soft shadows: the layers over a receiver towards the light's centre, counted among its cell's triangles, and the
// silhouette edges of its cell that the receiver sees on the light, each of which changes the count on one side of it.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "common/shadow_map_test.glsl"
#include "grid.glsl"
#include "grid_receiver.glsl"
#include "grid_layers.glsl"
#include "grid_edge.glsl"
#include "light_bits.glsl"
#include "common/pixel_steps.glsl"

layout(constant_id = 0) const bool MASKED = false; // the shadow map holds casters that have no triangles here
layout(constant_id = 1) const bool DISC = false;   // shape of the light; false: square

layout(binding = 3) uniform sampler2DArray shadow_map;
layout(binding = 10, scalar) readonly buffer EdgeHeader { ListHeader edge_header; };
layout(binding = 11, scalar) readonly buffer EdgeStarts { uint edge_starts[]; };
layout(binding = 12, scalar) readonly buffer EdgeEntries { uint edge_entries[]; };
layout(binding = 13, scalar) readonly buffer GridEdges { GridEdge grid_edges[]; };
layout(binding = 14, scalar) readonly buffer Receivers { vec3 receivers[]; };
layout(binding = 15) uniform sampler2D masked_visibility; // read only if MASKED

// False for a cell whose triangles or edges found no room.
bool hasCasters(uint cell) {
  return hasTriangles(cell) && edge_starts[cell + 1] <= push.entries && edge_header.lost == 0;
}

// The receiver's plane: change of depth per ndc.
vec2 planeSlope(Receiver r, GridReceiver g) {
  vec2 uv_slope = receiverPlane(view.light_clip_from_view[0], view.light_depth_scale[0], g.point, r.normal);
  float scale = view.light_depth_scale[0]; // 0 for a sun
  return 0.5 * uv_slope / max(scale, float(push.spot == 0));
}

// Share of the light that the receiver sees.
float lightSeen(Receiver r, GridReceiver g, uint cell) {
  vec2 slope = planeSlope(r, g), tilt = slope * push.kappa;
  LightBits bits = noLayers();
  bool partly = reachesBelow(tilt);
  uint changes = 0;
  float least = 1e-6 * abs(g.depth);
  for (uint i = edge_starts[cell]; i < edge_starts[cell + 1]; ++i) {
    GridEdge e = grid_edges[edge_entries[i]];
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

// Visibility of a pixel, from its depth and normal on.
float visibilityAt(ivec2 pixel) {
  Receiver r = receiverAt(pixel);
  GridReceiver g;
  float v;
  if (gridReceiver(pixel, r, g, v)) return v;
  uint cell = cellOf(g.ndc);
  v = hasCasters(cell) ? lightSeen(r, g, cell) : shadowMapTest(shadow_map, r, g.point, push.normal_offset, 0.0);
  return withMasked(pixel, v);
}

void main() {
  if (readsList()) {
    for (uint i = firstListed(); i < list.count; i += listStride()) {
      ivec2 pixel = unpackTile(list.pixels[i]);
      imageStore(visibility, pixel, vec4(visibilityAt(pixel)));
    }
    return;
  }
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  bool inside = all(lessThan(pixel, ivec2(view.size))), listed = false;
  if (inside && STEP == LIST) {
    vec3 r = receivers[uint(pixel.y) * view.size.x + uint(pixel.x)];
    if (r != NO_RECEIVER) {
      uint cell = cellOf(r.xy);
      listed = edge_starts[cell] != edge_starts[cell + 1] || !hasCasters(cell);
      if (!listed) imageStore(visibility, pixel, vec4(withMasked(pixel, layersOver(r, cell, false) == 0 ? 1.0 : 0.0)));
    }
  } else if (inside) {
    imageStore(visibility, pixel, vec4(visibilityAt(pixel)));
  }
  listPixel(pixel, listed);
}
