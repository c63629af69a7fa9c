// Constants of a frame, filled by src/technique/common/view.rs. common/receiver.glsl includes this file after
// lib/light_space.glsl.
#ifndef EDGESHADE_VIEW
#define EDGESHADE_VIEW
#extension GL_EXT_scalar_block_layout : require

const int MAX_LAYERS = 6;
// Encoding of the normal image. NORMAL_NONE derives the normals from depth.
const uint NORMAL_NONE = 0, NORMAL_OCTAHEDRAL_SIGNED = 1, NORMAL_OCTAHEDRAL_UNSIGNED = 2, NORMAL_CARTESIAN = 3;

layout(binding = 0, scalar) uniform ViewBlock {
  mat4 view_from_clip;                     // camera
  mat4 light_clip_from_view[MAX_LAYERS];   // camera view space to light clip space
  vec4 light_position_view[MAX_LAYERS];    // w = 1: position; w = 0: unit vector towards the light
  float light_depth_scale[MAX_LAYERS];     // near*far/(far-near), or 0 for a parallel light
  mat3 view_from_world;                    // rotation only
  uvec2 size;                              // camera image, pixels
  uvec2 map_size;                          // shadow map, texels
  uint normal_encoding;
  float far_depth;                         // camera depth where there is no surface
  float depth_error;                       // of the camera depth, absolute, towards the viewer; 0: relative only
  vec2 pixel_size;                         // world width of a pixel at eye depth z is x z + y; along the finer axis
  float off_axis;                          // largest secant of the angle between a view ray and the axis
  vec4 light_area[MAX_LAYERS];             // half-size factors: uv, world; depth offset; see lib/area_light.glsl
} view;

// Camera view-space position of a pixel with the given depth.
vec3 viewPosition(ivec2 pixel, float depth) {
  vec2 ndc = (2.0 * vec2(pixel) + 1.0) / vec2(view.size) - 1.0;
  // `precise` here and along the way to a shadow test gives the same arithmetic in every pipeline, so that skipping
  // work changes no bit.
  precise vec4 p = view.view_from_clip * vec4(ndc, depth, 1.0);
  precise vec3 position = p.xyz / p.w;
  return position;
}

LightPoint lightSpace(vec3 p, int layer) { return lightPoint(view.light_clip_from_view[layer], p); }

// Unit vector from p towards the light.
vec3 towardsLight(vec3 p, int layer) {
  vec4 l = view.light_position_view[layer];
  vec3 towards = normalize(l.xyz - p);
  return l.w == 0.0 ? l.xyz : towards;
}

#endif
