#version 460
// The world-space normal, octahedral in [-1, 1].
layout(location = 0) in vec3 normal;
layout(location = 0) out vec2 encoded;

void main() {
  vec3 n = normal / (abs(normal.x) + abs(normal.y) + abs(normal.z));
  vec2 side = vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
  encoded = n.z >= 0.0 ? n.xy : (1.0 - abs(n.yx)) * side;
}
