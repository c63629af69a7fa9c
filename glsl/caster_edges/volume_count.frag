#version 460
// Counts shadow volumes by blending. It adds the edge's multiplicity where a ray leaves a volume, and subtracts it
// where the ray enters one.

layout(location = 0) flat in float weight;
layout(location = 0) out float count;

void main() { count = gl_FrontFacing ? -weight : weight; }
