#version 460
// Pulls rectangles from a buffer, 6 vertices each.
#extension GL_EXT_scalar_block_layout : require

struct Quad {
  vec4 box;     // clip space: x0, y0, x1, y1
  float depth;
  float value;
  uint is_back; // reverses the winding
};

layout(binding = 0, scalar) readonly buffer Quads { Quad quads[]; };
layout(location = 0) flat out float value;

void main() {
  Quad q = quads[gl_VertexIndex / 6];
  const ivec2 corners[6] = ivec2[](ivec2(0, 0), ivec2(0, 1), ivec2(1, 1), ivec2(0, 0), ivec2(1, 1), ivec2(1, 0));
  int i = gl_VertexIndex % 6;
  ivec2 c = corners[q.is_back != 0 ? 5 - i : i];
  gl_Position = vec4(c.x == 0 ? q.box.x : q.box.z, c.y == 0 ? q.box.y : q.box.w, q.depth, 1.0);
  value = q.value;
}
