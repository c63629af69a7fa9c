#version 460
// Draws the sides of shadow volumes: a quad from each silhouette edge a -> b to infinity, facing outwards, with the
// corners a, a', b, b' as in a strip. The direction of the edge changes only the winding of its two triangles; each
// begins with the same corner either way. So rasterisers set both up alike, and sides that cancel do so exactly.
#extension GL_GOOGLE_include_directive : require
#include "volume.glsl"

layout(binding = 3, scalar) readonly buffer Silhouettes { SilhouetteEdge silhouettes[]; };

layout(location = 0) flat out float weight;

// Corners of both triangles: 0 and 1 are the end with the smaller index and its image at infinity, 2 and 3 the other
// end and its image.
const uint FORWARD[6] = uint[](0, 1, 2, 2, 1, 3), BACKWARD[6] = uint[](0, 2, 1, 2, 3, 1);

void main() {
  uint v = gl_VertexIndex;
  SilhouetteEdge s = silhouettes[v / 6];
  uint copies = cameras[s.instance].shells != 0 ? 1 : s.flags & SILHOUETTE_WEIGHT;
  uint corner = s.a < s.b ? FORWARD[v % 6] : BACKWARD[v % 6];
  vec3 p = positionOf(corner < 2 ? min(s.a, s.b) : max(s.a, s.b));
  mat4 m = cameras[s.instance].clip_from_object;
  vec4 near = m * vec4(p, 1.0), far = infinityOf(p, lights[s.instance].light, m);
  weight = float(copies);
  gl_Position = gl_InstanceIndex >= copies ? NOWHERE : (corner & 1) != 0 ? far : near;
}
