#version 460
// Computes the depth bounds of blocks of 8, 16, 32 and 64 shadow-map texels in one pass; see lib/depth_bounds.glsl.
// Texels outside the map count as farther than everything.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "lib/depth_bounds.glsl"
#include "lib/shadow_test.glsl"

// A workgroup covers 64 x 64 texels, a thread 8 x 8.
layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2DArray shadow_map;
layout(binding = 1) writeonly uniform image2D blocks_8; // slope.xy, low, high
layout(binding = 2) writeonly uniform image2D blocks_16;
layout(binding = 3) writeonly uniform image2D blocks_32;
layout(binding = 4) writeonly uniform image2D blocks_64;

layout(push_constant, scalar) uniform Push {
  ivec2 map_size;
  int layer;
} push;

shared DepthBounds shared_blocks[8][8];

// Depths of 2 x 2 texels in gather order: (0, 1), (1, 1), (1, 0), (0, 0).
vec4 quad(ivec2 first, bool inside) {
  // One gather at the common corner of the four texels: rounding of the coordinate cannot select other texels there.
  if (inside) return textureGather(shadow_map, vec3(vec2(first + 1) / vec2(push.map_size), push.layer));
  return vec4(shadowMapDepth(shadow_map, first + ivec2(0, 1), push.layer, push.map_size),
              shadowMapDepth(shadow_map, first + ivec2(1, 1), push.layer, push.map_size),
              shadowMapDepth(shadow_map, first + ivec2(1, 0), push.layer, push.map_size),
              shadowMapDepth(shadow_map, first, push.layer, push.map_size));
}

DepthBounds blockBounds(ivec2 first) {
  bool inside = all(lessThanEqual(first + 8, push.map_size));
  vec4 quads[16];
  vec2 slope = vec2(3.0e38);
  for (int i = 0; i < 16; ++i) {
    vec4 q = quad(first + 2 * ivec2(i & 3, i >> 2), inside);
    quads[i] = q;
    // An empty texel lies on no surface, so its quad says nothing about the slope.
    if (max(max(q.x, q.y), max(q.z, q.w)) < 1.0) slope = flatter(slope, 0.5 * vec2(q.y - q.x + q.z - q.w, q.x - q.w + q.y - q.z));
  }
  DepthBounds b;
  b.slope = slope.x > 1.0e38 ? vec2(0.0) : usefulSlope(slope);
  b.low = 1.0e38;
  b.high = -1.0e38;
  for (int i = 0; i < 16; ++i) {
    // The way from the block's centre to the quad's first texel.
    vec2 t = vec2(2 * (i & 3), 2 * (i >> 2)) - 3.5;
    vec4 d = quads[i] - (dot(b.slope, t) + vec4(b.slope.y, b.slope.x + b.slope.y, b.slope.x, 0.0));
    b.low = min(b.low, min(min(d.x, d.y), min(d.z, d.w)));
    b.high = max(b.high, max(max(d.x, d.y), max(d.z, d.w)));
  }
  float rounding = boundsRounding(b.slope, 8.0);
  b.low -= rounding;
  b.high += rounding;
  return b;
}

DepthBounds mergeBlocks(ivec2 t, int child_size) {
  int n = child_size / 8;
  DepthBounds b;
  b.slope = flatter(flatter(shared_blocks[t.y][t.x].slope, shared_blocks[t.y][t.x + n].slope),
                    flatter(shared_blocks[t.y + n][t.x].slope, shared_blocks[t.y + n][t.x + n].slope));
  b.low = 1.0e38;
  b.high = -1.0e38;
  for (int i = 0; i < 4; ++i) {
    ivec2 side = ivec2(i & 1, i >> 1);
    includeBlock(b, shared_blocks[t.y + side.y * n][t.x + side.x * n], (vec2(side) - 0.5) * float(child_size), float(child_size));
  }
  return b;
}

void main() {
  ivec2 block = ivec2(gl_GlobalInvocationID.xy);
  ivec2 t = ivec2(gl_LocalInvocationID.xy);
  DepthBounds b = blockBounds(8 * block);
  imageStore(blocks_8, block, vec4(b.slope, b.low, b.high));
  shared_blocks[t.y][t.x] = b;
  for (int level = 1; level <= 3; ++level) {
    barrier();
    int step = 1 << level;
    if ((t.x & (step - 1)) == 0 && (t.y & (step - 1)) == 0) {
      b = mergeBlocks(t, 8 << (level - 1));
      shared_blocks[t.y][t.x] = b;
      vec4 value = vec4(b.slope, b.low, b.high);
      if (level == 1) imageStore(blocks_16, block >> 1, value);
      if (level == 2) imageStore(blocks_32, block >> 2, value);
      if (level == 3) imageStore(blocks_64, block >> 3, value);
    }
  }
}
