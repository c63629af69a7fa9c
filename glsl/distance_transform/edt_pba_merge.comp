#version 460
// Joins the sites of neighbouring groups of bands: phase 2 of the Parallel Banding Algorithm, second half (Cao, Tang,
// Mohamed, Tan 2010). It runs for groups of 1, 2, 4 ... bands; a thread works on one row of a pair of groups. Sites
// stay in place. The pass drops sites that no longer own a pixel, from the end of the left group and from the beginning
// of the right one.
#extension GL_GOOGLE_include_directive : require
#include "edt.glsl"

layout(local_size_x = 32) in;

layout(binding = 0, scalar) buffer Sites { uvec2 sites[]; };
layout(binding = 1, scalar) buffer Bands { uint bands[]; };

uint bandSlot(uint band) { return band * push.size.y + gl_GlobalInvocationID.x; }
uint siteSlot(uint i) { return i * push.size.y + gl_GlobalInvocationID.x; }

// The first band from `band` on that has sites, or `end`.
uint nextBand(uint band, uint end) {
  for (; band < end; band++) {
    uvec2 range = seedOf(bands[bandSlot(band)]);
    if (range.x < range.y) break;
  }
  return band;
}

void main() {
  uint y = gl_GlobalInvocationID.x;
  uint first = gl_GlobalInvocationID.y * 2 * push.merge, middle = first + push.merge;
  if (y >= push.size.y || middle >= push.bands) return;
  uint end = min(middle + push.merge, push.bands);

  uint right = nextBand(middle, end);
  if (right == end) return;
  uvec2 right_range = seedOf(bands[bandSlot(right)]);
  uint left = middle; // band to the right of the band of site b
  uvec2 left_range = uvec2(0);
  uvec2 c = sites[siteSlot(right_range.x)];
  uvec2 b;
  bool has_left = false, look_left = true;
  for (;;) {
    if (look_left) {
      // The last site of the left group.
      while (left_range.x >= left_range.y && left > first) left_range = seedOf(bands[bandSlot(--left)]);
      has_left = left_range.x < left_range.y;
      if (has_left) b = sites[siteSlot(left_range.y - 1)];
      look_left = false;
    }
    uint start = has_left ? uint(max(firstNearer(b.x, c.x, y), 0)) : 0;
    if (has_left && start <= b.y) {
      left_range.y--;
      bands[bandSlot(left)] = left_range.x | left_range.y << 16;
      look_left = true;
      continue;
    }
    // The site after c.
    uint next = right, next_site = right_range.x + 1;
    uvec2 next_range = right_range;
    if (next_site >= right_range.y) {
      next = nextBand(right + 1, end);
      if (next < end) {
        next_range = seedOf(bands[bandSlot(next)]);
        next_site = next_range.x;
      }
    }
    bool has_next = next < end;
    uvec2 d = has_next ? sites[siteSlot(next_site)] : uvec2(NO_SEED, push.size.x);
    if (start < d.y) {
      sites[siteSlot(right_range.x)].y = start;
      return;
    }
    right_range.x++;
    bands[bandSlot(right)] = right_range.x | right_range.y << 16;
    if (!has_next) return;
    right = next;
    right_range = uvec2(next_site, next_range.y);
    c = d;
  }
}
