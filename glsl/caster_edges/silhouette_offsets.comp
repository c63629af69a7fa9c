#version 460
// Turns each workgroup's number of silhouette edges into the index at which it writes them: an exclusive scan in one
// workgroup. Also writes the arguments of later draws and dispatches.
#extension GL_GOOGLE_include_directive : require
#include "casters.glsl"

layout(local_size_x = 256) in;

layout(binding = 0, scalar) buffer Offsets { uint offsets[]; };
layout(binding = 1, scalar) buffer Header { SilhouetteHeader header; };

layout(push_constant, scalar) uniform Push {
  uint chunk_count;
  uint stride;
} push;

shared uint sums[256];

void main() {
  uint local = gl_LocalInvocationIndex, each = (push.chunk_count + 255) / 256;
  uint first = min(local * each, push.chunk_count), end = min(first + each, push.chunk_count);
  uint sum = 0;
  for (uint i = first; i < end; ++i) sum += offsets[i];
  sums[local] = sum;
  barrier();
  for (uint step = 1; step < 256; step *= 2) {
    uint other = local >= step ? sums[local - step] : 0;
    barrier();
    sums[local] += other;
    barrier();
  }
  uint at = sums[local] - sum;
  for (uint i = first; i < end; ++i) {
    uint n = offsets[i];
    offsets[i] = at;
    at += n;
  }
  if (local != 0) return;
  uint count = sums[255], groups = (count + 63) / 64;
  header.groups[0] = min(groups, MAX_GROUPS_X);
  header.groups[1] = (groups + MAX_GROUPS_X - 1) / MAX_GROUPS_X;
  header.groups[2] = 1;
  header.count = count;
  header.volumes[0] = 6 * count;
  header.volumes[1] = header.max_weight;
  header.volumes[2] = 0;
  header.volumes[3] = 0;
  header.quads[0] = 6 * count;
  header.quads[1] = 1;
  header.quads[2] = 0;
  header.quads[3] = 0;
  uint walks = (count + 3) / 4;
  header.walks[0] = min(walks, MAX_GROUPS_X);
  header.walks[1] = (walks + MAX_GROUPS_X - 1) / MAX_GROUPS_X;
  header.walks[2] = 1;
}
