#version 460
// Makes the sides and far caps of shadow volumes from triangles by geometry shader, as in [EDSM] section 2.2.
// Departures: the input has no adjacency; neighbours come from a table, and their facing from stored bits instead of a
// second determinant. Near caps are drawn separately (volume_cap.vert). Where three or more triangles meet in an edge,
// each gets a side of its own; sides that cancel are drawn too.
#extension GL_GOOGLE_include_directive : require
#include "volume.glsl"
#include "volume_triangle.glsl"

layout(triangles) in;
layout(triangle_strip, max_vertices = 21) out;

layout(binding = 7, scalar) readonly buffer Neighbours { uvec3 neighbours[]; }; // faces across the edges (0,1), (1,2), (2,0)
const uint NO_NEIGHBOUR = 0xFFFFFFFFu, FAN = 0xFFFFFFFEu;

layout(location = 0) in vec4 infinity[];
layout(location = 1) flat in uint instance_of[];
layout(location = 2) flat in uint triangle_of[];

layout(location = 0) flat out float weight;

void emit(vec4 a, vec4 b, vec4 c) {
  vec4 corners[3] = vec4[](a, b, c);
  for (int i = 0; i < 3; ++i) {
    weight = 1.0;
    gl_Position = corners[i];
    EmitVertex();
  }
  EndPrimitive();
}

void main() {
  uint instance = instance_of[0], t = triangle_of[0];
  CasterInstance info = instances[instance];
  if (t >= info.triangles) return;
  uint first_bit = CHUNK * info.first_triangle_chunk;
  bool faces = facesLight(first_bit, t);
  if (!counts(instance, faces)) return;
  uvec3 v = triangles[info.first_triangle + t], across = neighbours[info.first_triangle + t];
  for (uint k = 0; k < 3; ++k) {
    uint l = k == 2 ? 0 : k + 1, face = across[k];
    if (face != NO_NEIGHBOUR && face != FAN) {
      // The neighbour's side of the edge, in the direction in which this triangle runs along it.
      bool same_way = ((face & REVERSED) != 0) == (v[k] > v[l]);
      bool other = facesLight(first_bit, face & ~REVERSED) == same_way;
      if (other != faces) continue;
    }
    bool swapped = v[k] > v[l];
    uint low = swapped ? l : k, high = swapped ? k : l;
    vec4 a = gl_in[low].gl_Position, a_far = infinity[low];
    vec4 b = gl_in[high].gl_Position, b_far = infinity[high];
    // The direction of the edge changes only the winding, not the order of the corners, as in volume_side.vert.
    if (faces != swapped) {
      emit(a, a_far, b);
      emit(b, a_far, b_far);
    } else {
      emit(a, b, a_far);
      emit(b, b_far, a_far);
    }
  }
  // The far cap of a parallel light is a single point.
  if (lights[instance].light.w == 0.0) return;
  vec4 i = infinity[0], j = infinity[1], k = infinity[2];
  emit(i, faces ? k : j, faces ? j : k);
}
