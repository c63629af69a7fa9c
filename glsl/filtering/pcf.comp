#version 460
// Percentage-closer filtering over all pixels, over those that the depth bounds do not decide, or over the tiles that
// pcf_classify.comp listed. The image is the same. NEAREST and FIXED give the form of Reeves, Salesin, Cook (1987). The
// depth bounds cover a row and a column more than NEAREST reads, so they decide it as well. See lib/pcf.glsl.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "lib/pcf.glsl"
#include "common/pcf_bounds.glsl"
#include "pcf_receiver.glsl"
#include "common/tiles.glsl"

layout(constant_id = 0) const int WIDTH = 3;    // odd
layout(constant_id = 1) const bool GATHER = true;
layout(constant_id = 2) const bool LISTED = false;
layout(constant_id = 3) const bool BOUNDED = false;

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 3) uniform sampler2DArray shadow_map;
layout(binding = 4) writeonly uniform image2D visibility;
layout(binding = 5, scalar) readonly buffer TileList {
  uint groups[3];
  uint count;
  uint tiles[];
} list;
layout(binding = 6) uniform sampler2D blocks; // depth_bounds.comp; read only if BOUNDED

float visibilityAt(ivec2 pixel) {
  PcfKernel kernel;
  float decided;
  if (pcfReceiver(pixel, WIDTH, kernel, decided)) return decided;
  ivec2 map_size = ivec2(view.map_size);
  if (BOUNDED) {
    int decision = decideKernel(blocks, kernel, 0.0, WIDTH, map_size);
    if (decision != UNDECIDED) return float(decision);
  }
  if (NEAREST) return pcfNearest(shadow_map, kernel, WIDTH, 0, map_size);
  return GATHER ? pcfGather(shadow_map, kernel, WIDTH, 0, map_size) : pcfLoop(shadow_map, kernel, WIDTH, 0, map_size);
}

void shadePixel(ivec2 pixel) {
  if (any(greaterThanEqual(pixel, ivec2(view.size)))) return;
  imageStore(visibility, pixel, vec4(visibilityAt(pixel)));
}

void main() {
  if (!LISTED) {
    shadePixel(ivec2(gl_GlobalInvocationID.xy));
    return;
  }
  for (uint i = gl_WorkGroupID.x; i < list.count; i += gl_NumWorkGroups.x) {
    shadePixel(8 * unpackTile(list.tiles[i]) + ivec2(gl_LocalInvocationID.xy));
  }
}
