#version 460
// First half of a summed-area table: the moments of the shadow map as integers, summed from the top of each column.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "lib/shadow_test.glsl"
#include "lib/moments.glsl"
#include "moment_kind.glsl"
#include "table_unit.glsl"

// A workgroup sums 16 columns, which its threads cut into 8 parts.
const int COLUMNS = 16, PARTS = 8;
layout(local_size_x = COLUMNS, local_size_y = PARTS) in;

layout(binding = 0) uniform sampler2DArray shadow_map;
layout(binding = 1) writeonly uniform uimage2D summed_columns;

layout(push_constant, scalar) uniform Push {
  ivec2 map_size;
  float range; // far / near - 1, or 0 for a parallel light
  float scale;
} push;

shared uvec4 parts[PARTS][COLUMNS];

uvec4 texelAt(ivec2 texel) {
  return quantised(shadowMapDepth(shadow_map, texel, 0, push.map_size), push.range, push.scale);
}

void main() {
  int x = int(gl_GlobalInvocationID.x), column = int(gl_LocalInvocationID.x), part = int(gl_LocalInvocationID.y);
  int rows = (push.map_size.y + PARTS - 1) / PARTS, first = part * rows, end = min(first + rows, push.map_size.y);
  uvec4 sum = uvec4(0);
  for (int y = first; y < end; ++y) sum += texelAt(ivec2(x, y));
  parts[part][column] = sum;
  barrier();
  if (x >= push.map_size.x) return;
  sum = uvec4(0);
  for (int i = 0; i < part; ++i) sum += parts[i][column];
  for (int y = first; y < end; ++y) {
    sum += texelAt(ivec2(x, y));
    imageStore(summed_columns, ivec2(x, y), sum);
  }
}
