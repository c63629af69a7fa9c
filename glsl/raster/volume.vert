#version 460
// Input of volume.geom: a triangle's corners, at their place and at infinity.
#extension GL_GOOGLE_include_directive : require
#include "volume_triangle.glsl"

layout(location = 0) out Corner {
  vec4 infinity;
  flat uint instance;
  flat uint triangle; // of the instance's; the last chunk is not full
} corner;

invariant corner.infinity;

void main() {
  uint v = gl_VertexIndex;
  corner.instance = chunks[v / (3 * CHUNK)];
  CasterInstance info = instances[corner.instance];
  corner.triangle = v / 3 - CHUNK * info.first_triangle_chunk;
  vec3 p = positionOf(triangles[info.first_triangle + min(corner.triangle, info.triangles - 1)][v % 3]);
  mat4 m = cameras[corner.instance].clip_from_object;
  gl_Position = m * vec4(p, 1.0);
  corner.infinity = infinityOf(p, lights[corner.instance].light, m);
}
