#version 460
// Counts shadow volumes by blending: leaving one counts +1, entering one -1, as often as the edge's multiplicity says.

layout(location = 0) flat in float weight;
layout(location = 0) out float count;

void main() { count = gl_FrontFacing ? -weight : weight; }
