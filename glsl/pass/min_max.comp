#version 460
// Minimum and maximum depth over blocks of 8, 16, 32 and 64 texels, in one pass.
// The lower levels of a hierarchical shadow map: Guennebaud, Barthe, Paulin (2006).
// Texels outside the map count as farther than everything.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "lib/shadow_test.glsl"

// A workgroup covers 64 x 64 texels, a thread 8 x 8.
layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2DArray shadow_map;
layout(binding = 1) writeonly uniform image2D blocks_8;
layout(binding = 2) writeonly uniform image2D blocks_16;
layout(binding = 3) writeonly uniform image2D blocks_32;
layout(binding = 4) writeonly uniform image2D blocks_64;

layout(push_constant, scalar) uniform Push {
  ivec2 map_size;
  int layer;
} push;

shared vec2 range[8][8];

vec2 merge(vec2 a, vec2 b) { return vec2(min(a.x, b.x), max(a.y, b.y)); }

vec2 blockRange(ivec2 first) {
  // One gather reads 2 x 2 texels at their common corner, where no rounding can pick another block.
  vec2 r = vec2(1.0, 0.0);
  if (all(lessThanEqual(first + 8, push.map_size))) {
    vec2 texel = 1.0 / vec2(push.map_size);
    for (int y = 1; y < 8; y += 2) {
      for (int x = 1; x < 8; x += 2) {
        vec4 d = textureGather(shadow_map, vec3(vec2(first + ivec2(x, y)) * texel, push.layer));
        r = merge(r, vec2(min(min(d.x, d.y), min(d.z, d.w)), max(max(d.x, d.y), max(d.z, d.w))));
      }
    }
    return r;
  }
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      r = merge(r, vec2(shadowMapDepth(shadow_map, first + ivec2(x, y), push.layer, push.map_size)));
    }
  }
  return r;
}

void main() {
  ivec2 block = ivec2(gl_GlobalInvocationID.xy);
  ivec2 t = ivec2(gl_LocalInvocationID.xy);
  vec2 r = blockRange(8 * block);
  imageStore(blocks_8, block, vec4(r, 0.0, 0.0));
  range[t.y][t.x] = r;
  for (int level = 1; level <= 3; ++level) {
    barrier();
    int step = 1 << level, half_step = step >> 1;
    if ((t.x & (step - 1)) == 0 && (t.y & (step - 1)) == 0) {
      r = merge(merge(range[t.y][t.x], range[t.y][t.x + half_step]),
                merge(range[t.y + half_step][t.x], range[t.y + half_step][t.x + half_step]));
      range[t.y][t.x] = r;
      ivec2 target = block >> level;
      if (level == 1) imageStore(blocks_16, target, vec4(r, 0.0, 0.0));
      if (level == 2) imageStore(blocks_32, target, vec4(r, 0.0, 0.0));
      if (level == 3) imageStore(blocks_64, target, vec4(r, 0.0, 0.0));
    }
  }
}
