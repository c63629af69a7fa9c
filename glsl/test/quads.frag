#version 460
// Writes the rectangle's value to red and twice the value to green.
layout(location = 0) flat in float value;
layout(location = 0) out vec4 color;

void main() { color = vec4(value, 2.0 * value, 0.0, 1.0); }
