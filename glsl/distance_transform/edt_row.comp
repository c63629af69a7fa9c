#version 460
// Finds the nearest seeds within the radius, row by row. A thread works on one row of a segment of columns: it finds
// the sites of the segment and of the columns within the radius around it, then walks back over them. It leaves a row
// without seeds in reach cleared. The workgroups take segments in turn, so that the sites of one segment stay in a
// cache.
//
// With GAPS, edt_row_window.comp has found the seeds of whole tiles of 32 pixels, and a segment is a gap between these.
// From one pixel to the next, the nearest column never moves left. So a gap needs only the columns between those that are
// nearest to the pixels on either side of it.
#extension GL_GOOGLE_include_directive : require
#include "edt.glsl"

// Rows of one block, so that neighbouring threads do nearly the same work.
layout(local_size_x = 8) in;

// Number of sites that a thread keeps in an array of its own, or 1 for none. A CPU driver reaches such an array several
// times faster than a buffer.
layout(constant_id = 0) const uint OWN_SITES = 1;
uvec2 own_sites[OWN_SITES];
layout(constant_id = 1) const bool GAPS = false; // for unbounded transforms, in segments as wide as the image

layout(binding = 2, scalar) buffer Sites { uvec2 sites[]; };
// Rows are padded to whole quads. In the time of one store to an image, a CPU driver stores four pixels to a buffer.
layout(binding = 3, scalar) buffer Labels { uvec4 labels[]; }; // read if GAPS
layout(binding = 4, scalar) writeonly buffer SquaredDistances { uvec4 squared_distances[]; };
layout(binding = 5, scalar) buffer Active { uint active_rows; };
layout(binding = 6, scalar) readonly buffer Done { uint done[]; }; // edt_row_window.comp; read if GAPS

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

uint quads() { return (push.size.x + 3) / 4; }
uint tiles() { return (push.size.x + 31) / 32; }

// Works on the pixels begin..end of row y, whose nearest seeds lie in the columns from..to. Returns false if there are none in
// reach.
bool workOnPart(uint y, uint from, uint to, uint begin, uint end) {
  uvec2 top;
  uint count = envelope(y, from, to, begin, end, top);
  if (push.radius < FAR - 1 && count == 0) return false; // these rows are cleared already
  for (uint quad = (end + 3) / 4; quad-- > begin / 4;) {
    uvec2 p3 = uvec2(NO_SEED), p2 = p3, p1 = p3, p0 = p3;
    if (count > 0) {
      p3 = pixel(uvec2(4 * quad + 3, y), top, count);
      p2 = pixel(uvec2(4 * quad + 2, y), top, count);
      p1 = pixel(uvec2(4 * quad + 1, y), top, count);
      p0 = pixel(uvec2(4 * quad, y), top, count);
    }
    labels[quad + quads() * y] = uvec4(p0.x, p1.x, p2.x, p3.x);
    if (push.squared) squared_distances[quad + quads() * y] = uvec4(p0.y, p1.y, p2.y, p3.y);
  }
  return true;
}

// Column of the nearest seed of a pixel that has found it.
uint nearestColumn(uint x, uint y) { return labels[x / 4 + quads() * y][x % 4] & 0xffffu; }

bool isDone(uint tile, uint y) { return done[tile + tiles() * y] != 0; }

// Works on the gaps of row y. Returns false if there are none.
bool workOnGaps(uint y) {
  bool found = false;
  for (uint tile = 0; tile < tiles();) {
    uint first = tile;
    while (first < tiles() && isDone(first, y)) first++;
    tile = first;
    while (tile < tiles() && !isDone(tile, y)) tile++;
    if (first == tiles()) break;
    uint from = 0, to = push.size.x;
    if (first > 0) from = nearestColumn(32 * first - 1, y);
    if (tile < tiles()) to = nearestColumn(32 * tile, y) + 1;
    workOnPart(y, from, to, 32 * first, min(32 * tile, push.size.x));
    found = true;
  }
  return found;
}

void main() {
  uint segments = (push.size.x + push.span - 1) / push.span;
  uint items = segments * ((push.size.y + 7) / 8);
  for (uint item = gl_WorkGroupID.x; item < items; item += gl_NumWorkGroups.x) {
    uint begin = item % segments * push.span, end = min(begin + push.span, push.size.x);
    uint y = item / segments * 8 + gl_LocalInvocationID.x;
    if (y >= push.size.y) continue;
    uint from = begin - min(begin, push.radius), to = min(end + push.radius, push.size.x);
    bool worked;
    if (GAPS) worked = workOnGaps(y);
    else worked = workOnPart(y, from, to, begin, end);
    if (worked) atomicAdd(active_rows, 1);
  }
}
