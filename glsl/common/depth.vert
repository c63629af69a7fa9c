#version 460
// Renders the shadow map: depth only.
#extension GL_GOOGLE_include_directive : require
#include "instance.glsl"

layout(location = 0) in vec3 position;

void main() { gl_Position = instances[gl_InstanceIndex].clip_from_object * vec4(position, 1.0); }
