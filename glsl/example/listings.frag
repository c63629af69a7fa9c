#version 460
// The papers' listings in another engine's fragment shader: filtered shadow edges (listing 5), at the fragment's own
// depth.
#extension GL_GOOGLE_include_directive : require
#include "lib/rbsm_listings.glsl"

layout(location = 0) out float visibility;
layout(binding = 0) uniform sampler2D world_position; // w is 0 where there is no surface
layout(binding = 1) uniform sampler2D world_normal;   // not read
layout(binding = 2) uniform sampler2D shadow_map;     // depth 0 near to 1 far
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
  vec4 position = texelFetch(world_position, ivec2(gl_FragCoord.xy), 0);
  precise vec3 ndc = (light.clip_from_world * vec4(position.xyz, 1.0)).xyz;
  bool inside = ndc.z >= 0.0 && ndc.z <= 1.0 && all(lessThanEqual(abs(ndc.xy), vec2(1.0)));
  vec2 uv = 0.5 * ndc.xy + 0.5;
  vec3 p = vec3(uv * vec2(textureSize(shadow_map, 0)), ndc.z - light.bias);
  visibility = position.w > 0.0 && inside ? RBSM(p, false) : 1.0;
}
