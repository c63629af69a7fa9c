#version 460
// The engine's lighting: red is how much light arrives, blue is sky.
layout(binding = 0) uniform sampler2D visibility; // made by Edgeshade
layout(binding = 1) uniform sampler2D depth;

layout(push_constant) uniform Push {
  float far_depth; // what the pre-pass cleared to
} push;

layout(location = 0) out vec4 color;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  if (texelFetch(depth, pixel, 0).x == push.far_depth) {
    color = vec4(0.0, 0.0, 1.0, 1.0);
    return;
  }
  float lit = texelFetch(visibility, pixel, 0).x;
  color = vec4(0.2 + 0.8 * lit, 0.0, 0.0, 1.0);
}
