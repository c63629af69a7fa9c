#version 460
// Copies the caller's depth into the library's own target, bit by bit.

layout(binding = 0) uniform sampler2D camera_depth;

void main() { gl_FragDepth = texelFetch(camera_depth, ivec2(gl_FragCoord.xy), 0).x; }
