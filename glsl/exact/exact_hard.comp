#version 460
// Hard shadows: a receiver is dark if any of its cell's triangles covers it on the side of the light.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "common/shadow_map_test.glsl"
#include "grid.glsl"
#include "grid_layers.glsl"

layout(constant_id = 0) const bool MASKED = false; // the shadow map holds casters that have no triangles here

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 3) uniform sampler2DArray shadow_map;
layout(binding = 4) writeonly uniform image2D visibility;
layout(binding = 5, scalar) readonly buffer Receivers { vec3 receivers[]; };

// Visibility in the shadow map, for casters that have no triangles and cells whose lists found no room.
float mapVisibility(ivec2 pixel) {
  Receiver r = receiverAt(pixel);
  return shadowMapTest(shadow_map, r, lightSpace(r.position, 0), push.normal_offset, 0.0);
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, ivec2(view.size)))) return;
  vec3 r = receivers[uint(pixel.y) * view.size.x + uint(pixel.x)];
  if (r == NO_RECEIVER) return;
  uint cell = cellOf(r.xy);
  bool room = hasTriangles(cell);
  float v = room && layersOver(r, cell, false) != 0 ? 0.0 : 1.0;
  if (!room || MASKED && v != 0.0) v = mapVisibility(pixel);
  imageStore(visibility, pixel, vec4(v));
}
