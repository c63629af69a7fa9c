#version 460
// Second half of a summed-area table: the summed columns, summed from the left of each row.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// A workgroup sums a row, in strides of 512 texels; a thread sums 4 neighbours.
const int THREADS = 128, OWN = 4;
layout(local_size_x = THREADS) in;

layout(binding = 0) uniform usampler2D summed_columns;
layout(binding = 1) writeonly uniform uimage2D table;

layout(push_constant, scalar) uniform Push {
  ivec2 map_size;
  float range;
  float scale;
} push;

shared uvec4 sums[THREADS];

void main() {
  int i = int(gl_LocalInvocationIndex), y = int(gl_WorkGroupID.y);
  uvec4 before = uvec4(0); // of the strides to the left
  for (int start = 0; start < push.map_size.x; start += THREADS * OWN) {
    int first = start + OWN * i;
    uvec4 own[OWN];
    uvec4 sum = uvec4(0);
    for (int k = 0; k < OWN; ++k) {
      if (first + k < push.map_size.x) sum += texelFetch(summed_columns, ivec2(first + k, y), 0);
      own[k] = sum;
    }
    sums[i] = sum;
    barrier();
    // Sums of 1, 2, 4 ... threads up to this one.
    for (int reach = 1; reach < THREADS; reach *= 2) {
      uvec4 left = i >= reach ? sums[i - reach] : uvec4(0);
      barrier();
      sums[i] += left;
      barrier();
    }
    uvec4 left = before + sums[i] - sum;
    for (int k = 0; k < OWN; ++k) {
      if (first + k < push.map_size.x) imageStore(table, ivec2(first + k, y), left + own[k]);
    }
    before += sums[THREADS - 1];
    barrier();
  }
}
