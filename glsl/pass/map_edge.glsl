// A silhouette edge as the shadow map has it, and whether what it bounds is hidden there. map_edges.comp writes the list.
#ifndef EDGESHADE_MAP_EDGE
#define EDGESHADE_MAP_EDGE
#extension GL_EXT_scalar_block_layout : require
#include "lib/bias.glsl"
#include "lib/shadow_test.glsl"

struct MapEdge {
  vec2 a, b;    // ends, texels; the occluder lies on the right of a -> b, y down
  float za, zb; // their depths in the map, which along the edge are as straight as it is
  uint flags;
};
const uint MAP_EDGE_SEEN = 1u; // some of it lies in the map or next to it
// The end is one of the edge's own, not where it was cut.
const uint MAP_EDGE_A = 2u, MAP_EDGE_B = 4u;

// Share of the way from a to b at which the edge's line comes nearest to a point.
float placeAlong(MapEdge e, vec2 p) {
  precise vec2 along = e.b - e.a, away = p - e.a;
  precise float t = dot(away, along) / dot(along, along);
  return t;
}

float depthAlong(MapEdge e, float t) {
  precise float z = e.za + t * (e.zb - e.za);
  return z;
}

// True where an edge at a point of the map lies behind all that the map holds around it. Next to the edge the map holds the
// occluder itself, which may be nearer than its edge; but of an edge that the light sees, one side always is farther.
bool isHidden(sampler2DArray shadow_map, ivec2 map_size, MapEdge e, vec2 p, float z) {
  ivec2 middle = ivec2(floor(p));
  float farthest = 0.0;
  for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x) farthest = max(farthest, shadowMapDepth(shadow_map, middle + ivec2(x, y), 0, map_size));
  precise float slope = abs(e.zb - e.za) / max(distance(e.a, e.b), 1.0);
  return z > farthest + 2.0 * DEPTH_ULPS + slope;
}

#endif
