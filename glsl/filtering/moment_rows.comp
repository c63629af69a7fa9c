#version 460
// First half of a separable filter: the moments of every texel of the shadow map, filtered along its row. Texels outside
// the map are farther than everything.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "lib/shadow_test.glsl"
#include "lib/moments.glsl"
#include "moment_kind.glsl"
#include "moment_kernel.glsl"

// A workgroup filters 128 texels of a row.
const int SIDE = 128;
layout(local_size_x = SIDE) in;

layout(binding = 0) uniform sampler2DArray shadow_map;
layout(binding = 1) writeonly uniform image2D filtered_rows;

layout(push_constant, scalar) uniform Push {
  ivec2 map_size;
  float range;    // far / near - 1, or 0 for a parallel light
  vec2 exponents; // of the warps
} push;

shared vec4 row[SIDE + 2 * RADIUS];
shared float weights[2 * RADIUS + 1];

void main() {
  int i = int(gl_LocalInvocationIndex);
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  int first = texel.x - i - RADIUS;
  for (int k = i; k < SIDE + 2 * RADIUS; k += SIDE) {
    row[k] = momentsOf(shadowMapDepth(shadow_map, ivec2(first + k, texel.y), 0, push.map_size), push.range, push.exponents);
  }
  for (int k = i; k < 2 * RADIUS + 1; k += SIDE) weights[k] = kernelWeight(k - RADIUS);
  barrier();
  if (any(greaterThanEqual(texel, push.map_size))) return;
  vec4 sum = vec4(0.0);
  float all = 0.0;
  for (int k = 0; k <= 2 * RADIUS; ++k) {
    sum += weights[k] * row[i + k];
    all += weights[k];
  }
  imageStore(filtered_rows, texel, sum / all);
}
