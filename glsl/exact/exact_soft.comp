#version 460
// Soft shadows: the layers over a receiver towards the light's centre, counted among its cell's triangles, and the
// silhouette edges of its cell that the receiver sees on the light, each of which changes the count on one side of it.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "common/shadow_map_test.glsl"
#include "grid.glsl"
#include "grid_receiver.glsl"
#include "grid_triangle.glsl"
#include "grid_edge.glsl"
#include "light_bits.glsl"
#include "common/pixel_steps.glsl"

layout(constant_id = 0) const bool MASKED = false; // the shadow map holds casters that have no triangles here
layout(constant_id = 1) const bool DISC = false;   // shape of the light; false: square

layout(binding = 3) uniform sampler2DArray shadow_map;
layout(binding = 6, scalar) readonly buffer Header { ListHeader header; };
layout(binding = 7, scalar) readonly buffer Starts { uint starts[]; };
layout(binding = 8, scalar) readonly buffer Entries { uint entries[]; };
layout(binding = 9, scalar) readonly buffer GridTriangles { GridTriangle grid_triangles[]; };
layout(binding = 10, scalar) readonly buffer EdgeHeader { ListHeader edge_header; };
layout(binding = 11, scalar) readonly buffer EdgeStarts { uint edge_starts[]; };
layout(binding = 12, scalar) readonly buffer EdgeEntries { uint edge_entries[]; };
layout(binding = 13, scalar) readonly buffer GridEdges { GridEdge grid_edges[]; };

// Number of layers between the receiver and the light's centre; without `all`, at most 1.
uint layersOver(GridReceiver g, bool all) {
  uint layers = 0;
  for (uint i = starts[g.cell]; i < starts[g.cell + 1]; ++i) {
    uint t = entries[i];
    if (coversPlace(grid_triangles[t].lines, grid_triangles[t].inner, g.ndc) &&
        planeDepth(grid_triangles[t].plane, grid_triangles[t].range, g.ndc) < g.depth) {
      ++layers;
      if (!all) break;
    }
  }
  return layers;
}

// The receiver's plane: change of depth per ndc.
vec2 planeSlope(Receiver r, GridReceiver g) {
  vec2 uv_slope = receiverPlane(view.light_clip_from_view[0], view.light_depth_scale[0], g.point, r.normal);
  return 0.5 * uv_slope / (push.spot != 0 ? view.light_depth_scale[0] : 1.0);
}

// Share of the light that the receiver sees.
float lightSeen(Receiver r, GridReceiver g) {
  vec2 slope = planeSlope(r, g), tilt = slope * push.kappa;
  LightBits bits = noLayers();
  bool partly = reachesBelow(tilt);
  float least = 1e-6 * abs(g.depth);
  for (uint i = edge_starts[g.cell]; i < edge_starts[g.cell + 1]; ++i) {
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
    addEdge(bits, from, to, e.weight, DISC);
  }
  uint layers = layersOver(g, partly);
  return partly ? lightVisible(bits, layers, tilt, DISC) : layers == 0 ? 1.0 : 0.0;
}

// Finds the visibility of a pixel. Returns false if the pixel is left for the dispatch over the list.
bool visibilityAt(ivec2 pixel, out float v) {
  Receiver r = receiverAt(pixel);
  GridReceiver g;
  if (gridReceiver(pixel, r, g, v)) return true;
  if (starts[g.cell + 1] > push.entries || header.lost != 0 || edge_starts[g.cell + 1] > push.entries || edge_header.lost != 0) {
    v = shadowMapTest(shadow_map, r, g.point, 1.0, 0.0);
    return true;
  }
  if (STEP == LIST) {
    if (g.grazing || edge_starts[g.cell] != edge_starts[g.cell + 1]) return false;
    v = layersOver(g, false) == 0 ? 1.0 : 0.0;
    return true;
  }
  v = lightSeen(r, g);
  return true;
}

void main() {
  float v;
  if (readsList()) {
    for (uint i = firstListed(); i < list.count; i += listStride()) {
      ivec2 pixel = unpackTile(list.pixels[i]);
      visibilityAt(pixel, v);
      imageStore(visibility, pixel, vec4(v));
    }
    return;
  }
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  bool inside = all(lessThan(pixel, ivec2(view.size)));
  bool decided = inside && visibilityAt(pixel, v);
  if (decided) imageStore(visibility, pixel, vec4(v));
  listPixel(pixel, inside && !decided);
}
