// Common part of the techniques that draw silhouette edges into a map of the shadow map's size: which edges count, and
// which of them the light sees.
#ifndef EDGESHADE_DRAWN_EDGE
#define EDGESHADE_DRAWN_EDGE
#extension GL_EXT_scalar_block_layout : require
#include "lib/edge_segment.glsl"
#include "lib/shadow_test.glsl"

// An edge seen end-on has no sides.
bool isDrawn(EdgeSegment e) { return e.flags != 0 && e.a != e.b; }

// Tests whether an edge, at a point of the map, lies behind everything that the map holds around the point. Next to the
// edge the map holds the occluder itself, which may be nearer than its edge. But an edge that the light sees always has
// something farther on one side.
bool isHidden(sampler2DArray shadow_map, ivec2 map_size, EdgeSegment e, vec2 p, float z) {
  ivec2 middle = ivec2(floor(p));
  float farthest = 0.0;
  for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x) farthest = max(farthest, shadowMapDepth(shadow_map, middle + ivec2(x, y), 0, map_size));
  precise float slope = abs(e.zb - e.za) / max(distance(e.a, e.b), 1.0);
  return z > farthest + 2.0 * DEPTH_ULPS + slope;
}

#endif
