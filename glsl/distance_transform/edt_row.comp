#version 460
// Finds the nearest seeds within the radius, row by row. A thread works on one row of a segment of columns: it finds
// the sites of the segment and of the columns within the radius around it, then walks back over them. It leaves a row
// without seeds in reach cleared. The workgroups take segments in turn, so that the sites of one segment stay in a
// cache.
#extension GL_GOOGLE_include_directive : require
#include "edt.glsl"

// Rows of one block, so that neighbouring threads do nearly the same work.
layout(local_size_x = 8) in;

// Number of sites that a thread keeps in an array of its own, or 1 for none. A CPU driver reaches such an array several
// times faster than a buffer.
layout(constant_id = 0) const uint OWN_SITES = 1;
uvec2 own_sites[OWN_SITES];

layout(binding = 2, scalar) buffer Sites { uvec2 sites[]; };
// Rows are padded to whole quads. In the time of one store to an image, a CPU driver stores four pixels to a buffer.
layout(binding = 3, scalar) writeonly buffer Labels { uvec4 labels[]; };
layout(binding = 4, scalar) writeonly buffer SquaredDistances { uvec4 squared_distances[]; };
layout(binding = 5, scalar) buffer Active { uint active_rows; };

uint slot(uint i) { return gl_LocalInvocationID.x + 8 * (i + gl_WorkGroupID.x * push.span); }
uvec2 loadSite(uint i) { return OWN_SITES > 1 ? own_sites[i] : sites[slot(i)]; }
void storeSite(uint i, uvec2 site) {
  if (OWN_SITES > 1) own_sites[i] = site;
  else sites[slot(i)] = site;
}

#include "edt_envelope.glsl"

// Label and squared distance of a pixel. Pixels must come from right to left.
uvec2 pixel(uvec2 p, inout uvec2 top, inout uint count) {
  uint squared;
  uvec2 result = uvec2(NO_SEED);
  if (inReach(top.x, p, squared)) result = uvec2(top.x, squared);
  if (p.x == top.y && count > 1) top = loadSite(--count - 1);
  return result;
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
    if (push.radius < FAR - 1 && count == 0) continue; // these rows are cleared already
    atomicAdd(active_rows, 1);
    uint quads = (push.size.x + 3) / 4;
    for (uint quad = (end + 3) / 4; quad-- > begin / 4;) {
      uvec2 p3 = uvec2(NO_SEED), p2 = p3, p1 = p3, p0 = p3;
      if (count > 0) {
        p3 = pixel(uvec2(4 * quad + 3, y), top, count);
        p2 = pixel(uvec2(4 * quad + 2, y), top, count);
        p1 = pixel(uvec2(4 * quad + 1, y), top, count);
        p0 = pixel(uvec2(4 * quad, y), top, count);
      }
      labels[quad + quads * y] = uvec4(p0.x, p1.x, p2.x, p3.x);
      if (push.squared) squared_distances[quad + quads * y] = uvec4(p0.y, p1.y, p2.y, p3.y);
    }
  }
}
