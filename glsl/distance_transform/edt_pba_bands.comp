#version 460
// Finds the sites of every band of columns: phase 2 of the Parallel Banding Algorithm, first half (Cao, Tang, Mohamed,
// Tan 2010). A thread works on one row of a band.
#extension GL_GOOGLE_include_directive : require
#include "edt.glsl"

layout(local_size_x = 32) in;

// The sites of a band begin at its first column. Rows lie side by side, so that neighbouring threads touch neighbouring
// memory.
layout(binding = 2, scalar) buffer Sites { uvec2 sites[]; };
// Range of the sites of band k in row y: begin | end << 16 at k * height + y.
layout(binding = 3, scalar) writeonly buffer Bands { uint bands[]; };

uint slot(uint i) { return (gl_GlobalInvocationID.y * push.span + i) * push.size.y + gl_GlobalInvocationID.x; }
uvec2 loadSite(uint i) { return sites[slot(i)]; }
void storeSite(uint i, uvec2 site) { sites[slot(i)] = site; }

#include "edt_envelope.glsl"

void main() {
  uint y = gl_GlobalInvocationID.x, band = gl_GlobalInvocationID.y;
  if (y >= push.size.y || band >= push.bands) return;
  uint from = min(band * push.span, push.size.x), to = min(from + push.span, push.size.x);
  uvec2 top;
  uint count = envelope(y, from, to, 0, push.size.x, top);
  bands[band * push.size.y + y] = from | from + count << 16;
}
