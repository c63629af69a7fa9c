#version 460
// Gives every pixel its nearest seed: phase 3 of the Parallel Banding Algorithm (Cao, Tang, Mohamed, Tan 2010). A
// thread works on one row of a block of columns.
#extension GL_GOOGLE_include_directive : require
#include "edt.glsl"

layout(local_size_x = 32) in;

layout(binding = 0, scalar) readonly buffer Sites { uvec2 sites[]; };
layout(binding = 1, scalar) readonly buffer Bands { uint bands[]; };
layout(binding = 2, r32ui) writeonly uniform uimage2D labels;
layout(binding = 3, r32ui) writeonly uniform uimage2D squared_distances;

uvec2 bandRange(uint band) { return seedOf(bands[band * push.size.y + gl_GlobalInvocationID.x]); }
uvec2 site(uint i) { return sites[i * push.size.y + gl_GlobalInvocationID.x]; }

void main() {
  uint y = gl_GlobalInvocationID.x;
  uint begin = gl_GlobalInvocationID.y * push.span, end = min(begin + push.span, push.size.x);
  if (y >= push.size.y || begin >= end) return;

  // The site that owns the first pixel: the last site that begins no later, in the last band whose first site begins no
  // later.
  uint band = push.bands;
  uvec2 range = uvec2(0);
  for (uint k = 0; k < push.bands; k++) {
    uvec2 r = bandRange(k);
    if (r.x >= r.y) continue;
    if (site(r.x).y > begin) break;
    band = k;
    range = r;
  }
  uint low = range.x, high = range.y; // site `low` begins no later than the first pixel, site `high` later
  while (high > low + 1) {
    uint middle = (low + high) / 2;
    if (site(middle).y <= begin) low = middle;
    else high = middle;
  }
  uvec2 current = band < push.bands ? site(low) : uvec2(NO_SEED, 0);

  uvec2 next;
  bool look = true;
  for (uint x = begin; x < end; x++) {
    if (!look && next.y <= x) {
      current = next;
      look = true;
    }
    if (look) {
      look = false;
      next = uvec2(NO_SEED, push.size.x);
      if (++low >= range.y && band < push.bands) {
        for (band++; band < push.bands; band++) {
          range = bandRange(band);
          if (range.x < range.y) break;
        }
        low = range.x;
      }
      if (band < push.bands) next = site(low);
    }
    uint squared;
    bool reached = inReach(current.x, uvec2(x, y), squared);
    imageStore(labels, ivec2(x, y), uvec4(reached ? current.x : NO_SEED));
    if (push.squared) imageStore(squared_distances, ivec2(x, y), uvec4(reached ? squared : NO_SEED));
  }
}
