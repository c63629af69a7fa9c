#version 460
// Nearest seeds row by row, within the radius: a thread a row of a segment of columns finds the sites of the segment and of
// the radius around it, then walks back over them. A segment without seeds in reach is left at once. The workgroups share
// out the segments in turn, so that the sites of one stay in a cache.
#extension GL_GOOGLE_include_directive : require
#include "edt_envelope.glsl"

// Rows of one block: neighbouring threads do nearly the same.
layout(local_size_x = 8) in;

layout(binding = 2, scalar) buffer Sites { uvec2 sites[]; };
layout(binding = 3, r32ui) writeonly uniform uimage2D labels;
layout(binding = 4, r32ui) writeonly uniform uimage2D squared_distances;
layout(binding = 5, scalar) buffer Active { uint active_segments; };

uint slot(uint i) { return gl_LocalInvocationID.x + 8 * (i + gl_WorkGroupID.x * min(push.span + 2 * push.radius, push.size.x)); }
uvec2 loadSite(uint i) { return sites[slot(i)]; }
void storeSite(uint i, uvec2 site) { sites[slot(i)] = site; }

void store(uvec2 p, uint label, uint squared) {
  imageStore(labels, ivec2(p), uvec4(label));
  if (push.squared) imageStore(squared_distances, ivec2(p), uvec4(squared));
}

void main() {
  uint segments = (push.size.x + push.span - 1) / push.span;
  uint tiles = (push.size.x + 31) / 32;
  uint items = segments * ((push.size.y + 7) / 8);
  for (uint item = gl_WorkGroupID.x; item < items; item += gl_NumWorkGroups.x) {
    uint begin = item % segments * push.span, end = min(begin + push.span, push.size.x);
    uint y = item / segments * 8 + gl_LocalInvocationID.x;
    if (y >= push.size.y) continue;
    uint from = begin - min(begin, push.radius), to = min(end + push.radius, push.size.x);
    uvec2 top;
    uint count = envelope(y, from, to, begin, end, top);
    if (count > 0 && gl_LocalInvocationID.x == 0) atomicAdd(active_segments, 1);
    for (uint x = end; x-- > begin;) {
      uint squared;
      bool reached = inReach(top.x, uvec2(x, y), squared);
      store(uvec2(x, y), reached && count > 0 ? top.x : NO_SEED, reached && count > 0 ? squared : NO_SEED);
      if (x == top.y && count > 1) top = loadSite(--count - 1);
    }
  }
}
