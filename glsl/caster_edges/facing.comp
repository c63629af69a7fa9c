#version 460
// Finds the triangles that face the light, by the plane form: the sign of n . (L - v0). The result is one bit per
// triangle, computed once. All later passes read the bit, so that the edges of a triangle never disagree about it, and
// no silhouette has a hole.
#extension GL_GOOGLE_include_directive : require
#include "casters.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Positions { float positions[]; };
layout(binding = 1, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(binding = 2, scalar) readonly buffer Chunks { uint chunks[]; }; // instance of each workgroup
layout(binding = 3, scalar) readonly buffer Instances { CasterInstance instances[]; };
layout(binding = 4, scalar) readonly buffer Lights { CasterLight lights[]; };
layout(binding = 5, scalar) writeonly buffer Facing { uint facing[]; };

layout(push_constant, scalar) uniform Push {
  uint chunk_count;
  uint stride; // floats from one vertex to the next
} push;

shared uint bits[2];

vec3 positionOf(uint v) {
  uint i = v * push.stride;
  return vec3(positions[i], positions[i + 1], positions[i + 2]);
}

bool facesLight(uvec3 t, vec4 light) {
  precise vec3 v0 = positionOf(t.x), a = positionOf(t.y) - v0, b = positionOf(t.z) - v0;
  precise vec3 n = vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  precise vec3 d = light.xyz - light.w * v0;
  precise float side = n.x * d.x + n.y * d.y + n.z * d.z;
  // Triangles that are edge-on to within rounding count as facing. Any constant would do, as long as there is a single
  // bit.
  vec3 u = abs(a), v = abs(b), size = abs(light.xyz) + light.w * abs(v0);
  float bound = 1e-6 * dot(vec3(u.y * v.z + u.z * v.y, u.z * v.x + u.x * v.z, u.x * v.y + u.y * v.x), size);
  return side >= -bound;
}

void main() {
  uint chunk = chunkIndex(gl_WorkGroupID), local = gl_LocalInvocationIndex;
  if (local < 2) bits[local] = 0;
  barrier();
  bool inside = chunk < push.chunk_count;
  uint instance = chunks[min(chunk, push.chunk_count - 1)];
  uint t = CHUNK * (chunk - instances[instance].first_triangle_chunk) + local;
  inside = inside && t < instances[instance].triangles;
  if (inside) {
    // A mirroring transform reverses every triangle.
    bool front = facesLight(triangles[instances[instance].first_triangle + t], lights[instance].light);
    if (front == (lights[instance].orientation > 0.0)) atomicOr(bits[local >> 5], 1u << (local & 31u));
  }
  barrier();
  if (local < 2 && chunk < push.chunk_count) facing[2 * chunk + local] = bits[local];
}
