#version 460
// Draws caps of shadow volumes: the casters' own triangles, or their images at infinity, with corners in their original
// order. Separate draws select the triangles that face the light and those that do not; one of them reverses the front
// face instead of the corners. So a cap is rasterised exactly like the surface it lies on.
#extension GL_GOOGLE_include_directive : require
#include "volume.glsl"
#include "volume_triangle.glsl"

layout(location = 0) flat out float weight;

void main() {
  uint v = gl_VertexIndex;
  uint instance = chunks[v / (3 * CHUNK)];
  CasterInstance info = instances[instance];
  uint first_bit = CHUNK * info.first_triangle_chunk, t = v / 3 - first_bit;
  bool faces = facesLight(first_bit, t);
  bool drawn = t < info.triangles && uint(faces) == push.facing && counts(instance, faces);
  uint corner = triangles[info.first_triangle + min(t, info.triangles - 1)][v % 3];
  vec3 p = positionOf(corner);
  weight = 1.0;
  mat4 m = cameras[instance].clip_from_object;
  if (push.infinite != 0) {
    gl_Position = drawn ? infinityOf(p, lights[instance].light, m) : NOWHERE;
  } else {
    vec4 q = m * vec4(p, 1.0);
    gl_Position = drawn ? vec4(q.xy, q.z + push.depth_step * q.w, q.w) : NOWHERE;
  }
}
