// A rectangle around an edge of the shadow map, without vertex buffers: the vertex index selects edge and corner, 6
// vertices per edge.
// Include after drawn_edge.glsl.
#ifndef EDGESHADE_EDGE_QUAD
#define EDGESHADE_EDGE_QUAD

layout(binding = 0, scalar) readonly buffer Segments { EdgeSegment segments[]; };
layout(location = 0) flat out uint edge_index;

// The rectangle reaches `half_width` texels to both sides and beyond both ends. `shift` moves the map's texels on the
// target.
void edgeQuad(float half_width, vec2 shift, vec2 map_size) {
  const ivec2 corners[6] = ivec2[](ivec2(0, 0), ivec2(0, 1), ivec2(1, 1), ivec2(0, 0), ivec2(1, 1), ivec2(1, 0));
  edge_index = gl_VertexIndex / 6;
  EdgeSegment e = segments[edge_index];
  gl_Position = vec4(-2.0, -2.0, 0.0, 1.0);
  if (!isDrawn(e)) return;
  vec2 d = e.b - e.a;
  float l = length(d);
  vec2 along = l > 0.0 ? d / l : vec2(1.0, 0.0), across = vec2(-along.y, along.x);
  vec2 c = vec2(corners[gl_VertexIndex % 6]);
  vec2 p = (c.x == 0.0 ? e.a - half_width * along : e.b + half_width * along) + (2.0 * c.y - 1.0) * half_width * across;
  gl_Position.xy = 2.0 * (p + shift) / map_size - 1.0;
}

#endif
