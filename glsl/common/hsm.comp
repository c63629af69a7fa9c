#version 460
// Builds the min/max pyramid of a shadow map, up to five levels at a time. An entry of level 0 covers 2 x 2 texels; the
// map itself serves as the level below. The image is padded to powers of two, so that entry c of level l covers the
// texels c 2^(l+1) to (c+1) 2^(l+1) - 1 whatever the map's size. Texels outside the map count as 1, farther than
// everything.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(constant_id = 0) const bool FROM_MAP = true; // false: reduces the level before

// A thread covers 4 x 4 texels of the source, a workgroup 32 x 32.
layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2DArray shadow_map;
layout(binding = 1) uniform sampler2D finer; // read unless FROM_MAP
layout(binding = 2) writeonly uniform image2D level_0;
layout(binding = 3) writeonly uniform image2D level_1;
layout(binding = 4) writeonly uniform image2D level_2;
layout(binding = 5) writeonly uniform image2D level_3;
layout(binding = 6) writeonly uniform image2D level_4;

layout(push_constant, scalar) uniform Push {
  ivec2 map_size;
  int layer;
  int levels; // levels to write, 1 to 5
} push;

shared vec2 entries[8][8];

vec2 merge(vec2 a, vec2 b) { return vec2(min(a.x, b.x), max(a.y, b.y)); }

// Returns an entry of the level before. Where that level is only one entry wide or high, there is no entry beside it.
vec2 cellOf(ivec2 at) {
  return all(lessThan(at, textureSize(finer, 0))) ? texelFetch(finer, at, 0).xy : vec2(1.0);
}

// Minimum and maximum of 2 x 2 texels of the source.
vec2 quad(ivec2 first) {
  if (FROM_MAP) {
    // Rounding cannot select other texels at the common corner of the four. The sampler's border is white.
    vec4 d = textureGather(shadow_map, vec3(vec2(first + 1) / vec2(push.map_size), push.layer));
    return vec2(min(min(d.x, d.y), min(d.z, d.w)), max(max(d.x, d.y), max(d.z, d.w)));
  }
  return merge(merge(cellOf(first), cellOf(first + ivec2(1, 0))), merge(cellOf(first + ivec2(0, 1)), cellOf(first + 1)));
}

void main() {
  ivec2 block = ivec2(gl_GlobalInvocationID.xy);
  ivec2 t = ivec2(gl_LocalInvocationID.xy);
  vec2 b = vec2(1.0, 0.0);
  for (int i = 0; i < 4; ++i) {
    ivec2 entry = 2 * block + ivec2(i & 1, i >> 1);
    vec2 q = quad(2 * entry);
    imageStore(level_0, entry, vec4(q, 0.0, 0.0));
    b = merge(b, q);
  }
  if (push.levels > 1) imageStore(level_1, block, vec4(b, 0.0, 0.0));
  entries[t.y][t.x] = b;
  for (int level = 2; level <= 4; ++level) {
    barrier();
    int n = 1 << (level - 2);
    if (level < push.levels && all(equal(t & (2 * n - 1), ivec2(0)))) {
      b = merge(merge(b, entries[t.y][t.x + n]), merge(entries[t.y + n][t.x], entries[t.y + n][t.x + n]));
      entries[t.y][t.x] = b;
      vec4 value = vec4(b, 0.0, 0.0);
      ivec2 entry = block >> (level - 1);
      if (level == 2) imageStore(level_2, entry, value);
      if (level == 3) imageStore(level_3, entry, value);
      if (level == 4) imageStore(level_4, entry, value);
    }
  }
}
