#version 460
// Shades the picture: key light times visibility, hemispherical ambient light, albedo, sky; tone-mapped to sRGB.
#extension GL_GOOGLE_include_directive : require
#include "receiver.glsl"
#include "lib/tone.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 3) uniform sampler2D albedo;
layout(binding = 4) uniform sampler2D visibility;
layout(binding = 5) writeonly uniform image2D picture;

layout(push_constant, scalar) uniform Push {
  vec3 light_color;    // key light at `reference_distance`, times exposure
  float ambient;       // strength of the hemispherical light
  float reference_distance; // of a spot light; 0 for a directional light
  float cos_outer;     // of a spot light's cone
  float cos_inner;
} push;

const vec3 ZENITH = vec3(0.30, 0.46, 0.78);
const vec3 HORIZON = vec3(0.78, 0.82, 0.86);
const vec3 GROUND = vec3(0.36, 0.32, 0.28);

vec3 skyColor(vec3 direction, vec3 up) {
  float h = clamp(dot(direction, up), 0.0, 1.0);
  return mix(HORIZON, ZENITH, 1.0 - exp(-4.0 * h));
}

float keyLight(vec3 p) {
  if (push.reference_distance == 0.0) return 1.0;
  vec3 d = p - view.light_position_view[0].xyz;
  float distance = length(d);
  if (!(distance > 0.0)) return 0.0;
  float axis = dot(d, normalize(rowOf(view.light_clip_from_view[0], 3))) / distance;
  float falloff = min(push.reference_distance / distance, 2.0);
  return smoothstep(push.cos_outer, push.cos_inner, axis) * falloff * falloff;
}

vec3 shade(ivec2 pixel) {
  Receiver r = receiverAt(pixel);
  vec3 up = view.view_from_world * vec3(0.0, 1.0, 0.0);
  vec4 far = view.view_from_clip * vec4((2.0 * vec2(pixel) + 1.0) / vec2(view.size) - 1.0, 0.5, 1.0);
  vec3 direction = normalize(r.surface ? r.position : far.xyz / far.w);
  vec3 sky = skyColor(direction, up);
  if (!r.surface) return sky;
  float key = max(dot(r.normal, towardsLight(r.position, 0)), 0.0) * keyLight(r.position);
  float lit = texelFetch(visibility, pixel, 0).x;
  vec3 ambient = push.ambient * mix(GROUND, mix(HORIZON, ZENITH, 0.6), 0.5 + 0.5 * dot(r.normal, up));
  return texelFetch(albedo, pixel, 0).rgb * (push.light_color * (key * lit) + ambient);
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, ivec2(view.size)))) return;
  imageStore(picture, pixel, vec4(srgbEncode(toneMap(shade(pixel))), 1.0));
}
