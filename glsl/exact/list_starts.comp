#version 460
// Turns the number of entries of each cell into the place where its list starts: an exclusive scan on two levels
// (Blelloch 1990). A first dispatch adds up each workgroup's cells; in a second one every workgroup adds up the sums
// before it and scans its own cells.
#extension GL_GOOGLE_include_directive : require
#include "grid.glsl"

layout(constant_id = 0) const bool SUMS = false;

layout(local_size_x = 256) in;

const uint EACH = 32; // cells of a thread

layout(binding = 0, scalar) buffer Header { ListHeader header; };
layout(binding = 1, scalar) readonly buffer Counts { uint counts[]; };
layout(binding = 2, scalar) buffer Sums { uint sums[]; };
layout(binding = 3, scalar) writeonly buffer Starts { uint starts[]; };

shared uint partial[256];

// Inclusive scan over the workgroup.
uint scan(uint value) {
  uint i = gl_LocalInvocationIndex;
  partial[i] = value;
  barrier();
  for (uint step = 1; step < 256; step *= 2) {
    uint other = i >= step ? partial[i - step] : 0;
    barrier();
    partial[i] += other;
    barrier();
  }
  return partial[i];
}

void main() {
  uint group = gl_WorkGroupID.x, local = gl_LocalInvocationIndex, cells = push.cells * push.cells;
  uint first = (256 * group + local) * EACH, own = 0;
  for (uint i = 0; i < EACH; ++i) {
    if (first + i < cells) own += counts[first + i];
  }
  if (SUMS) {
    uint all = scan(own);
    if (local == 255) sums[group] = all;
    return;
  }
  uint earlier = 0;
  for (uint i = local; i < group; i += 256) earlier += sums[i];
  scan(earlier);
  uint at = partial[255];
  barrier();
  at += scan(own) - own;
  uint longest = 0;
  for (uint i = 0; i < EACH; ++i) {
    if (first + i >= cells) break;
    starts[first + i] = at;
    at += counts[first + i];
    longest = max(longest, counts[first + i]);
  }
  if (longest > 0) atomicMax(header.longest, longest);
  if (first + EACH >= cells && first < cells) {
    starts[cells] = at;
    header.total = at;
  }
}
