#version 460
// Emits every triangle twice: as it is, and with its value negated.
layout(triangles) in;
layout(triangle_strip, max_vertices = 6) out;
layout(location = 0) flat in float value_in[];
layout(location = 0) flat out float value;

void main() {
  for (int copy = 0; copy < 2; ++copy) {
    for (int i = 0; i < 3; ++i) {
      gl_Position = gl_in[i].gl_Position;
      value = copy == 0 ? value_in[0] : -value_in[0];
      EmitVertex();
    }
    EndPrimitive();
  }
}
