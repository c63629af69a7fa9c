#version 460
// Counts shadow volumes by blending: +1 where a ray leaves a volume, -1 where it enters one, times the edge's
// multiplicity.

layout(location = 0) flat in float weight;
layout(location = 0) out float count;

void main() { count = gl_FrontFacing ? -weight : weight; }
