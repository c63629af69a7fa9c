#version 460
// Renders the camera's G-buffer.
#extension GL_GOOGLE_include_directive : require
#include "instance.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec2 uv;
layout(location = 2) in vec4 color;
layout(location = 3) in vec3 normal;

layout(location = 0) out vec2 fragment_uv;
layout(location = 1) out vec4 fragment_color;
layout(location = 2) out vec3 fragment_normal;   // world space, for shading
layout(location = 3) out vec3 fragment_position; // object space, for the geometric normal
layout(location = 4) flat out uint fragment_instance;

void main() {
  Instance i = instances[gl_InstanceIndex];
  fragment_uv = uv;
  fragment_color = color;
  fragment_normal = i.normal_from_object * normal;
  fragment_position = position;
  fragment_instance = gl_InstanceIndex;
  gl_Position = i.clip_from_object * vec4(position, 1.0);
}
