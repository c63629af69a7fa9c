#version 460
// Feeds volume.geom with a triangle's corners, at their own place and at infinity.
#extension GL_GOOGLE_include_directive : require
#include "volume.glsl"
#include "volume_triangle.glsl"

layout(location = 0) invariant out vec4 infinity;
layout(location = 1) flat out uint instance_of;
layout(location = 2) flat out uint triangle_of; // index within the instance

void main() {
  uint v = gl_VertexIndex;
  instance_of = chunks[v / (3 * CHUNK)];
  CasterInstance info = instances[instance_of];
  triangle_of = v / 3 - CHUNK * info.first_triangle_chunk;
  vec3 p = positionOf(triangles[info.first_triangle + min(triangle_of, info.triangles - 1)][v % 3]);
  mat4 m = cameras[instance_of].clip_from_object;
  gl_Position = m * vec4(p, 1.0);
  infinity = infinityOf(p, lights[instance_of].light, m);
}
