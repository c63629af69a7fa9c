#version 460
// Shadow silhouette maps: in a cell with lit and shadowed corners, the point takes the visibility of the corner in its
// quadrant. Sen, Cammarano, Hanrahan, "Shadow Silhouette Maps" (2003).
// Departure: corners are tested on the receiver's plane, so that a sloped receiver does not shadow itself.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "common/rbsm_receiver.glsl"
#include "sssm_quadrant.glsl"

layout(constant_id = 1) const bool PICTURE = false; // draw the points over the visibility

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 4) writeonly uniform image2D visibility;
layout(binding = 5) uniform usampler2D points;

// Cells outside the map hold their middles, like cells without an edge.
vec2 pointOf(ivec2 cell) {
  bool inside = all(greaterThanEqual(cell, ivec2(0))) && all(lessThan(cell, ivec2(view.map_size)));
  return inside ? unpackUnorm2x16(texelFetch(points, cell, 0).x) : vec2(0.5);
}

// Returns the cell of a point; `q` is the point's place in it.
ivec2 cellOf(ShadowPoint p, out vec2 q) {
  bvec2 later = greaterThanEqual(p.fraction, vec2(0.5));
  q = p.fraction + mix(vec2(0.5), vec2(-0.5), later);
  return p.texel + ivec2(later) - 1;
}

float lit(ShadowPoint p, ivec2 cell, vec2 q) {
  uint tests = shadowTest2x2(p, cell);
  if (tests == 0u || tests == 15u) return tests == 0u ? 0.0 : 1.0;
  vec2 neighbours[4];
  const ivec2 sides[4] = ivec2[](ivec2(-1, 0), ivec2(0, -1), ivec2(1, 0), ivec2(0, 1));
  for (int i = 0; i < 4; ++i) neighbours[i] = vec2(sides[i]) + pointOf(cell + sides[i]);
  return float(tests >> quadrantOf(q, pointOf(cell), neighbours) & 1u);
}

// The points of edges are orange, cells with an edge tinted; thin lines show the borders of cells.
vec3 picture(ivec2 cell, vec2 q, float v) {
  vec2 point = pointOf(cell), border = min(q, 1.0 - q);
  bool has_edge = abs(point.x - 0.5) + abs(point.y - 0.5) > 2e-5;
  vec3 color = mix(vec3(0.15), vec3(0.85), v);
  if (has_edge) color = mix(color, vec3(0.2, 0.5, 0.9), 0.4);
  if (min(border.x, border.y) < 0.03) color *= 0.8;
  return has_edge && distance(q, point) < 0.12 ? vec3(1.0, 0.5, 0.0) : color;
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, ivec2(view.size)))) return;
  ShadowPoint p;
  float v;
  vec3 color;
  if (rbsmReceiver(pixel, p, v)) {
    color = vec3(mix(0.15, 0.85, v));
  } else {
    vec2 q;
    ivec2 cell = cellOf(p, q);
    v = lit(p, cell, q);
    color = PICTURE ? picture(cell, q, v) : vec3(0.0);
  }
  imageStore(visibility, pixel, PICTURE ? vec4(color, 1.0) : vec4(v));
}
