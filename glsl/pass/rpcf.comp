#version 460
// Percentage-closer filtering of revectorized visibility; see lib/rpcf.glsl. Pixels whose kernel, with the ring around it,
// lies on one side of the shadow are decided by the depth bounds of the map's blocks: the same image.
#extension GL_GOOGLE_include_directive : require
layout(constant_id = 1) const int MAX_DISTANCE = 16;
#define MAXDIST MAX_DISTANCE
layout(constant_id = 2) const int WIDTH = 7; // odd
#define RPCF_WIDTH WIDTH
#include "rbsm_receiver.glsl"
#include "lib/rpcf.glsl"
#include "pcf_bounds.glsl"

layout(constant_id = 3) const int FUNCTION = 0; // listing 5, RBSM*, the edge profile
layout(constant_id = 4) const bool BOUNDED = false;

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 4) writeonly uniform image2D visibility;
layout(binding = 5) uniform sampler2D blocks; // depth_bounds.comp; read only if BOUNDED

// Tests of the kernel and its ring, one gather for 2 x 2 texels; true if all agree.
bool testKernel(ShadowPoint p) {
  vec2 size = vec2(view.map_size);
  ivec2 first = p.texel - WIDTH / 2 - 1;
  uint ones = 0u, zeros = 0u;
  uint left = 0u, right = 0u;
  for (int j = 0; j < WIDTH + 2; j += 2) {
    // Bit i is the ring's column i; column 32, the ring's last of the widest kernel, apart.
    uint upper = 0u, lower = 0u;
    uvec2 last = uvec2(0u);
    for (int i = 0; i < WIDTH + 2; i += 2) {
      ivec2 texel = first + ivec2(i, j);
      vec4 stored = textureGather(shadow_map, vec3(vec2(texel + 1) / size, 0.0));
      // Gather order: (0, 1), (1, 1), (1, 0), (0, 0).
      uint a = uint(shadowTest(receiverDepth(p, texel), stored.w));
      uint b = uint(shadowTest(receiverDepth(p, texel + ivec2(1, 0)), stored.z));
      uint c = uint(shadowTest(receiverDepth(p, texel + ivec2(0, 1)), stored.x));
      uint d = uint(shadowTest(receiverDepth(p, texel + ivec2(1, 1)), stored.y));
      if (i < 32) {
        upper |= a << i | b << i << 1;
        lower |= c << i | d << i << 1;
      } else {
        last = uvec2(a, c);
      }
    }
    if (WIDTH < 31) last = uvec2(upper >> (WIDTH + 1), lower >> (WIDTH + 1)) & 1u;
    for (int k = 0; k < 2 && j + k < WIDTH + 2; ++k) {
      uint bits = k == 0 ? upper : lower, row = bits >> 1 & RPCF_ALL;
      rpcf_rows[j + k] = row;
      ones |= row;
      zeros |= ~row;
      int at = j + k - 1;
      if (at >= 0 && at < WIDTH) {
        left |= (bits & 1u) << at;
        right |= (k == 0 ? last.x : last.y) << at;
      }
    }
  }
  rpcf_columns[0] = left;
  rpcf_columns[WIDTH + 1] = right;
  ones |= left | right;
  zeros |= ~(left & right);
  return (ones & RPCF_ALL) == 0u || (zeros & RPCF_ALL) == 0u;
}

float visibilityAt(ivec2 pixel) {
  ShadowPoint p;
  float decided;
  if (rbsmReceiver(pixel, p, decided)) return decided;
  ivec2 map_size = ivec2(view.map_size);
  if (BOUNDED) {
    // The kernel and its ring as a kernel of percentage-closer filtering of one texel less.
    ivec2 first = p.texel - WIDTH / 2 - 1;
    PcfKernel kernel = PcfKernel(first, vec2(0.0), p.z + dot(vec2(first - p.texel), p.dz), p.dz);
    int decision = decideKernel(blocks, kernel, float(WIDTH + 1) * p.slack, WIDTH + 1, map_size);
    if (decision != UNDECIDED) return float(decision);
  }
  if (testKernel(p)) return float(rpcf_rows[1] & 1u);
  for (int i = 0; i < WIDTH; ++i) {
    uint column = 0u;
    for (int j = 0; j < WIDTH; ++j) column |= (rpcf_rows[j + 1] >> i & 1u) << j;
    rpcf_columns[i + 1] = column;
  }
  return rpcfMean(p, FUNCTION);
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, ivec2(view.size)))) return;
  imageStore(visibility, pixel, vec4(visibilityAt(pixel)));
}
