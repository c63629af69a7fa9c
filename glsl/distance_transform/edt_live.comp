#version 460
// Finds the columns of a tile of 32 x 32 pixels with a seed in reach of any of its rows: one bit per column. Later
// passes visit only these columns.
#extension GL_GOOGLE_include_directive : require
#include "edt.glsl"

layout(local_size_x = 64) in;

layout(binding = 0) uniform usampler2D columns;
layout(binding = 1, scalar) writeonly buffer Live { uint live[]; };

void main() {
  uint tiles = (push.size.x + 31) / 32, tile = gl_GlobalInvocationID.x, block = gl_GlobalInvocationID.y;
  if (tile >= tiles || block >= (push.size.y + 31) / 32) return;
  uint bits = 0;
  for (uint i = 0; i < min(32, push.size.x - 32 * tile); i++) {
    uvec2 column = texelFetch(columns, ivec2(32 * tile + i, block), 0).xy;
    if (column.x != 0 || column.y != 0xffffffffu) bits |= 1u << i;
  }
  live[tile + tiles * block] = bits;
}
