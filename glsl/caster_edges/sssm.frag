#version 460
// Writes the point of an edge in a cell, and its key as depth: the depth test keeps the smallest key and, of equal
// ones, the first drawn.
#extension GL_GOOGLE_include_directive : require
#include "drawn_edge.glsl"
#include "sssm_cell.glsl"

layout(constant_id = 0) const bool KILL = true;

layout(binding = 0, scalar) readonly buffer Segments { EdgeSegment segments[]; };
layout(binding = 1) uniform sampler2DArray shadow_map;

layout(push_constant, scalar) uniform Push { uvec2 map_size; } push;

layout(location = 0) flat in uint edge_index;
layout(location = 0) out uint cell;

void main() {
  vec2 point;
  uint key;
  if (!seenCellPoint(shadow_map, ivec2(push.map_size), KILL, segments[edge_index], ivec2(gl_FragCoord.xy), point, key)) discard;
  cell = packCell(point);
  gl_FragDepth = float(key) / float(CELL_KEYS);
}
