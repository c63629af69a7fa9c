#version 460
// Revectorized shadows in another engine: takes positions, normals and a shadow map, writes visibility.
#extension GL_GOOGLE_include_directive : require
#define MAXDIST 32
#include "lib/light_space.glsl"
#include "lib/rbsm.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D world_position; // w is 0 where there is no surface
layout(binding = 1) uniform sampler2D world_normal;
layout(binding = 2) uniform sampler2D shadow_map;     // depth 0 near to 1 far
layout(binding = 3, r32f) writeonly uniform image2D visibility;
layout(push_constant) uniform Light {
  mat4 clip_from_world;
  float depth_scale; // near * far / (far - near) of a spot light, 0 for a directional light
  float bias;        // subtracted from the receiver's depth
} light;

float shadowTest(ShadowPoint p, ivec2 texel) {
  ivec2 size = textureSize(shadow_map, 0);
  if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, size))) return 1.0;
  return receiverDepth(p, texel) > texelFetch(shadow_map, texel, 0).x ? 0.0 : 1.0;
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(visibility)))) return;
  vec4 position = texelFetch(world_position, pixel, 0);
  vec3 normal = texelFetch(world_normal, pixel, 0).xyz;
  LightPoint l = lightPoint(light.clip_from_world, position.xyz);
  float v = 1.0;
  if (position.w > 0.0 && l.inside) {
    vec2 size = vec2(textureSize(shadow_map, 0));
    vec2 dz = receiverPlane(light.clip_from_world, light.depth_scale, l, normal) / size;
    v = RBSM(shadowPoint(l.uv * size, l.depth - light.bias, dz, 0.0), true);
  }
  imageStore(visibility, pixel, vec4(v));
}
