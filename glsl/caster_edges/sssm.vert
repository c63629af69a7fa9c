#version 460
// Draws quads that cover the middle of every cell of a shadow silhouette map that an edge touches. The middle is at
// most half a diagonal, 0.708 texels, away from the edge; the rest is for the rasteriser's grid of 1/256 texel.
#extension GL_GOOGLE_include_directive : require
#include "drawn_edge.glsl"
#include "edge_quad.glsl"

layout(push_constant, scalar) uniform Push { uvec2 map_size; } push;

// Cell (i, j) begins at the centre of texel (i, j).
void main() { edgeQuad(0.75, vec2(-0.5), vec2(push.map_size)); }
