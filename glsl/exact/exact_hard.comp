#version 460
// Hard shadows: a receiver is dark if any of its cell's triangles covers it on the side of the light.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "common/shadow_map_test.glsl"
#include "grid.glsl"
#include "grid_receiver.glsl"
#include "grid_triangle.glsl"

layout(constant_id = 0) const bool MASKED = false; // the shadow map holds casters that have no triangles here

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 3) uniform sampler2DArray shadow_map;
layout(binding = 4) writeonly uniform image2D visibility;
layout(binding = 5, scalar) readonly buffer Header { ListHeader header; };
layout(binding = 6, scalar) readonly buffer Starts { uint starts[]; };
layout(binding = 7, scalar) readonly buffer Entries { uint entries[]; };
layout(binding = 8, scalar) readonly buffer GridTriangles { GridTriangle grid_triangles[]; };

float visibilityAt(ivec2 pixel) {
  Receiver r = receiverAt(pixel);
  GridReceiver g;
  float decided;
  if (gridReceiver(pixel, r, g, decided)) return decided;
  uint end = starts[g.cell + 1];
  if (end > push.entries || header.lost != 0) return shadowMapTest(shadow_map, r, g.point, 1.0, 0.0);
  for (uint i = starts[g.cell]; i < end; ++i) {
    uint t = entries[i];
    if (coversPlace(grid_triangles[t].lines, grid_triangles[t].inner, g.ndc) &&
        planeDepth(grid_triangles[t].plane, grid_triangles[t].range, g.ndc) < g.depth) {
      return 0.0;
    }
  }
  return MASKED ? shadowMapTest(shadow_map, r, g.point, 1.0, 0.0) : 1.0;
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (all(lessThan(pixel, ivec2(view.size)))) imageStore(visibility, pixel, vec4(visibilityAt(pixel)));
}
