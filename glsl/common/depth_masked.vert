#version 460
// Renders the shadow map of alpha-tested casters.
#extension GL_GOOGLE_include_directive : require
#include "instance.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec2 uv;
layout(location = 2) in vec4 color;

layout(location = 0) out vec2 fragment_uv;
layout(location = 1) out float fragment_alpha;

void main() {
  fragment_uv = uv;
  fragment_alpha = color.a;
  gl_Position = instances[gl_InstanceIndex].clip_from_object * vec4(position, 1.0);
}
