#version 460
// The caller's depth into a target of ours, value by value.

layout(binding = 0) uniform sampler2D camera_depth;

void main() { gl_FragDepth = texelFetch(camera_depth, ivec2(gl_FragCoord.xy), 0).x; }
