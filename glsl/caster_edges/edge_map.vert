#version 460
// Draws a quad around every segment, wide enough for the centres of all cells that the segment enters; see
// edge_map.frag. There are no vertex buffers.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "lib/edge_segment.glsl"

layout(binding = 1, scalar) readonly buffer Segments { EdgeSegment segments[]; };

layout(push_constant, scalar) uniform Push {
  ivec2 map_size;
  float reach; // cells hold edges up to this many texels away
} push;

layout(location = 0) flat out uint index;

void main() {
  index = gl_VertexIndex / 6;
  EdgeSegment e = segments[index];
  vec2 d = e.b - e.a, along = dot(d, d) > 1e-8 ? normalize(d) : vec2(1.0, 0.0), across = vec2(-along.y, along.x);
  // Half the diagonal of a cell, plus a margin because vertices are snapped to 1/256 of a texel. The fragment shader
  // tests exactly.
  float reach = 1.41422 * (0.5 + push.reach) + 1.0 / 32.0;
  int corner = gl_VertexIndex % 6;
  bool at_b = corner == 1 || corner == 3 || corner == 4, left = corner >= 2 && corner != 3;
  vec2 p = (at_b ? e.b + reach * along : e.a - reach * along) + (left ? reach : -reach) * across;
  // A vertex without a segment lies outside the clip volume.
  bool valid = (e.flags & SEGMENT_VALID) != 0 && all(greaterThan(push.map_size, ivec2(1)));
  gl_Position = valid ? vec4(2.0 * (p - 0.5) / vec2(push.map_size - 1) - 1.0, 0.5, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}
