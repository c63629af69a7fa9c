#version 460
// Counts the fragments of each pixel in a buffer; there is no render target.
#extension GL_EXT_scalar_block_layout : require
layout(location = 0) flat in float value;
layout(binding = 1, scalar) buffer Counts { uint counts[]; };
layout(push_constant, scalar) uniform Push { uint width; } push;

void main() {
  uvec2 p = uvec2(gl_FragCoord.xy);
  atomicAdd(counts[p.y * push.width + p.x], uint(value));
}
