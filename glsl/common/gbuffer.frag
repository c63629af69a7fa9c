#version 460
// Writes the G-buffer: geometric normal (for shadows), shading normal, albedo, triangle id.
#extension GL_GOOGLE_include_directive : require
#include "instance.glsl"
#include "material.glsl"
#include "lib/octahedral.glsl"

layout(constant_id = 0) const bool MASKED = false; // a shader that may discard loses early depth tests

layout(location = 0) in vec2 fragment_uv;
layout(location = 1) in vec4 fragment_color;
layout(location = 2) in vec3 fragment_normal;
layout(location = 3) in vec3 fragment_position;
layout(location = 4) flat in uint fragment_instance;

layout(location = 0) out vec2 geometric_normal;
layout(location = 1) out vec2 shading_normal;
layout(location = 2) out vec4 albedo;
layout(location = 3) out uint triangle;

// Divides a vector by its largest component, so that no later product overflows or underflows.
vec3 unscaled(vec3 v) { return v / max(max(abs(v.x), abs(v.y)), abs(v.z)); }

void main() {
  vec4 color = push.base_color * fragment_color * sampleBaseColor(fragment_uv);
  if (MASKED && color.a < push.alpha_cutoff) discard;
  Instance i = instances[fragment_instance];
  // The derivatives are taken in object space, which keeps full precision however far away the object stands. At a
  // horizon they reach across it, to where the triangle's plane lies behind the viewer. They still lie in the plane
  // then, but their lengths and their winding mean nothing. So the side of the normal is chosen by the viewer's
  // position.
  vec3 n = i.normal_from_object * cross(unscaled(dFdy(fragment_position)), unscaled(dFdx(fragment_position)));
  float l = length(n);
  vec3 to_viewer = i.viewer.xyz - i.viewer.w * (i.world_from_object * fragment_position);
  vec3 shading = normalize(fragment_normal) * (gl_FrontFacing ? 1.0 : -1.0);
  n = l > 0.0 ? n / (dot(n, to_viewer) < 0.0 ? -l : l) : shading;
  geometric_normal = octahedralEncode(n);
  shading_normal = octahedralEncode(shading);
  albedo = vec4(color.rgb, 1.0);
  triangle = i.first_triangle + gl_PrimitiveID;
}
