#version 460
// Second half of a separable filter: the filtered rows, filtered along the columns. Rows outside the map are farther than
// everything.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "lib/moments.glsl"
#include "moment_kind.glsl"
#include "moment_kernel.glsl"

// A workgroup filters 32 columns of 64 texels, a thread 16 of a column: neighbouring threads read neighbouring texels.
const int COLUMNS = 32, ROWS = 64, PER_THREAD = 16;
layout(local_size_x = COLUMNS, local_size_y = ROWS / PER_THREAD) in;

layout(binding = 0) uniform sampler2D filtered_rows;
layout(binding = 1) writeonly uniform image2D moments;

layout(push_constant, scalar) uniform Push {
  ivec2 map_size;
  float range;
  vec2 exponents;
} push;

shared float weights[2 * RADIUS + 1];

void main() {
  int i = int(gl_LocalInvocationIndex);
  for (int k = i; k < 2 * RADIUS + 1; k += COLUMNS * ROWS / PER_THREAD) weights[k] = kernelWeight(k - RADIUS);
  barrier();
  ivec2 texel = ivec2(gl_GlobalInvocationID.x, gl_WorkGroupID.y * ROWS + gl_LocalInvocationID.y);
  if (texel.x >= push.map_size.x) return;
  vec4 far = momentsOf(1.0, push.range, push.exponents);
  for (int n = 0; n < PER_THREAD && texel.y < push.map_size.y; ++n) {
    vec4 sum = vec4(0.0);
    float all = 0.0;
    for (int k = 0; k <= 2 * RADIUS; ++k) {
      int y = texel.y + k - RADIUS;
      bool inside = y >= 0 && y < push.map_size.y;
      sum += weights[k] * (inside ? texelFetch(filtered_rows, ivec2(texel.x, y), 0) : far);
      all += weights[k];
    }
    imageStore(moments, texel, sum / all);
    texel.y += ROWS / PER_THREAD;
  }
}
