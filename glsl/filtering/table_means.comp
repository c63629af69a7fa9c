#version 460
// The moments of every texel of the shadow map, filtered by a box of WIDTH x WIDTH texels: four entries of a summed-area
// table, whatever the width. Texels outside the map are farther than everything.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "lib/moments.glsl"
#include "moment_kind.glsl"
#include "table_unit.glsl"
#include "summed_area.glsl"

layout(constant_id = 1) const int WIDTH = 3;          // odd
layout(constant_id = 2) const bool UNPACKED = false;  // four moments as floats, not packed as the table has them

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform usampler2D table;
layout(binding = 1) writeonly uniform image2D moments;

layout(push_constant, scalar) uniform Push {
  ivec2 map_size;
  float range;
  float scale;
} push;

void main() {
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, push.map_size))) return;
  ivec2 first = texel - WIDTH / 2, end = first + WIDTH;
  ivec2 inside = min(end, push.map_size) - max(first, ivec2(0));
  vec4 sum = vec4(sumOver(table, first, end)) / push.scale;
  float outside = float(WIDTH * WIDTH - inside.x * inside.y);
  vec4 far = toUnit(momentsOf(1.0, push.range, vec2(0.0)));
  vec4 m = (sum + outside * far) / float(WIDTH * WIDTH);
  if (KIND == VARIANCE) m.x = 2.0 * m.x - 1.0;
  if (UNPACKED) m = unpackMoments(m);
  imageStore(moments, texel, m);
}
