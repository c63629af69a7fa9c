#version 460
// The papers' listings in another engine's compute shader: filtered shadow edges (listing 5), at the fragment's own
// depth.
#extension GL_GOOGLE_include_directive : require
#include "lib/rbsm_listings.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D world_position; // w is 0 where there is no surface
layout(binding = 1) uniform sampler2D world_normal;   // not read
layout(binding = 2) uniform sampler2D shadow_map;     // depth 0 near to 1 far
layout(binding = 3, r32f) writeonly uniform image2D visibility;
layout(push_constant) uniform Light {
  mat4 clip_from_world; // of a directional light: its w is 1
  float depth_scale;    // not read
  float bias;           // subtracted from the receiver's depth
} light;

float shadowTest(vec3 p, ivec2 texel) {
  ivec2 size = textureSize(shadow_map, 0);
  if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, size))) return 1.0;
  return p.z > texelFetch(shadow_map, texel, 0).x ? 0.0 : 1.0;
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(visibility)))) return;
  vec4 position = texelFetch(world_position, pixel, 0);
  precise vec3 ndc = (light.clip_from_world * vec4(position.xyz, 1.0)).xyz;
  bool inside = ndc.z >= 0.0 && ndc.z <= 1.0 && all(lessThanEqual(abs(ndc.xy), vec2(1.0)));
  vec2 uv = 0.5 * ndc.xy + 0.5;
  vec3 p = vec3(uv * vec2(textureSize(shadow_map, 0)), ndc.z - light.bias);
  imageStore(visibility, pixel, vec4(position.w > 0.0 && inside ? RBSM(p, false) : 1.0));
}
