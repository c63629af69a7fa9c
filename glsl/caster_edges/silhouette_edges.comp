#version 460
// Finds the edges that bound shadows. Techniques that store edges in a map of the shadow map's size need those that
// pass the side test; shadow volumes need the multiplicity of edges (Kim, Kim, Turk 2008). One dispatch counts edges, a
// scan follows, and a second dispatch writes them (WRITE). The list therefore keeps the order of the meshes' edges,
// however workgroups are scheduled.
//
// side(T) = dir(T, e) sigma(T) is the side of the directed edge on which the third vertex of triangle T lies, seen from
// the light. If all triangles lie on one side, the edge is an outline. The sum of the sides is the number of sheets of
// a shadow volume that stand on the edge.
#extension GL_GOOGLE_include_directive : require
#include "casters.glsl"

layout(constant_id = 0) const bool WRITE = false;
layout(constant_id = 1) const bool SHELLS = true; // count closed meshes as shells, which halves the volumes

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Edges { uvec4 edges[]; }; // v0, v1, faces
layout(binding = 1, scalar) readonly buffer Fans { uint fans[]; };
layout(binding = 2, scalar) readonly buffer Chunks { uint chunks[]; };
layout(binding = 3, scalar) readonly buffer Instances { CasterInstance instances[]; };
layout(binding = 4, scalar) readonly buffer Lights { CasterLight lights[]; };
layout(binding = 5, scalar) readonly buffer Facing { uint facing[]; };
layout(binding = 6, scalar) buffer Offsets { uint offsets[]; }; // per workgroup: number of edges, then first index
layout(binding = 7, scalar) buffer Header { SilhouetteHeader header; };
layout(binding = 8, scalar) writeonly buffer Silhouettes { SilhouetteEdge silhouettes[]; };

layout(push_constant, scalar) uniform Push {
  uint chunk_count;
  uint stride;
} push;

shared uint found[2];

bool isFront(uint face, uint first_bit) {
  uint bit = first_bit + (face & ~REVERSED);
  return (facing[bit >> 5] >> (bit & 31u) & 1u) != 0;
}

// +1 if the face lies to the left of v0 -> v1, seen from the light, where triangles that face it are counter-clockwise.
int sideOf(uint face, uint first_bit) {
  return isFront(face, first_bit) == ((face & REVERSED) == 0) ? 1 : -1;
}

void main() {
  uint chunk = chunkIndex(gl_WorkGroupID), local = gl_LocalInvocationIndex;
  if (local < 2) found[local] = 0;
  barrier();
  uint instance = chunks[min(chunk, push.chunk_count - 1)];
  CasterInstance info = instances[instance];
  uint e = CHUNK * (chunk - info.first_edge_chunk) + local;
  int sum = 0;
  uint flags = 0, beside = 0;
  uvec4 edge = uvec4(0);
  if (chunk < push.chunk_count && e < info.edges && lights[instance].casts != 0) {
    edge = edges[info.first_edge + e];
    uint first_bit = CHUNK * info.first_triangle_chunk;
    uint faces = edge.w == NON_MANIFOLD ? fans[edge.z] : edge.w == BOUNDARY ? 1 : 2;
    for (uint i = 0; i < faces; ++i) {
      uint face = edge.w == NON_MANIFOLD ? fans[edge.z + 1 + i] : i == 0 ? edge.z : edge.w;
      sum += sideOf(face, first_bit);
      if (i == 0 || isFront(face, first_bit)) beside = info.first_triangle + (face & ~REVERSED);
    }
    if (abs(sum) == int(faces)) flags |= SILHOUETTE_OUTLINE;
    if (edge.w == BOUNDARY) flags |= SILHOUETTE_BOUNDARY;
  }
  if (sum != 0) atomicOr(found[local >> 5], 1u << (local & 31u));
  uint weight = uint(abs(sum)) >> (SHELLS && lights[instance].shell != 0 ? 1 : 0);
  if (!WRITE && sum != 0) atomicMax(header.max_weight, weight);
  barrier();
  if (chunk >= push.chunk_count) return;
  if (!WRITE) {
    if (local == 0) offsets[chunk] = bitCount(found[0]) + bitCount(found[1]);
    return;
  }
  if (sum == 0) return;
  uint before = local < 32 ? bitCount(found[0] & ((1u << local) - 1u))
                           : bitCount(found[0]) + bitCount(found[1] & ((1u << (local - 32)) - 1u));
  SilhouetteEdge s;
  s.a = sum > 0 ? edge.x : edge.y;
  s.b = sum > 0 ? edge.y : edge.x;
  s.instance = instance;
  s.flags = flags | min(weight, SILHOUETTE_WEIGHT);
  s.face = beside;
  silhouettes[offsets[chunk] + before] = s;
}
