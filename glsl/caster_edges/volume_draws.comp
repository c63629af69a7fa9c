#version 460
// Finds each instance's range in the list of silhouette edges and writes one draw for it, so that each instance can be
// left out or scissored.
#extension GL_GOOGLE_include_directive : require
#include "casters.glsl"

layout(constant_id = 0) const bool BLENDED = false; // weights are blended at once, without copies

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Instances { CasterInstance instances[]; };
layout(binding = 1, scalar) readonly buffer Offsets { uint offsets[]; }; // index at which each workgroup of edges wrote
layout(binding = 2, scalar) readonly buffer Header { SilhouetteHeader header; };
layout(binding = 3, scalar) readonly buffer Cameras { VolumeCamera cameras[]; };
layout(binding = 4, scalar) writeonly buffer Draws { uvec4 draws[]; };

layout(push_constant, scalar) uniform Push {
  uint instance_count;
  uint chunk_count; // number of workgroups of edges
} push;

uint offsetOf(uint chunk) { return chunk < push.chunk_count ? offsets[chunk] : header.count; }

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.instance_count) return;
  CasterInstance info = instances[i];
  uint first = offsetOf(info.first_edge_chunk);
  uint end = offsetOf(info.first_edge_chunk + (info.edges + CHUNK - 1) / CHUNK);
  uint copies = BLENDED || cameras[i].shells != 0 ? 1 : header.max_weight;
  draws[i] = uvec4(6 * (end - first), copies, 6 * first, 0);
}
