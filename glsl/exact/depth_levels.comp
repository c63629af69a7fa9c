#version 460
// Takes the greatest depth of receivers over blocks of 4, 16 and 64 cells, and over all cells. A workgroup works on 64
// x 64 cells.
#extension GL_GOOGLE_include_directive : require
#include "grid.glsl"

layout(local_size_x = 16, local_size_y = 16) in;

layout(binding = 0, scalar) buffer Depths { uint depths[]; };

shared uint fine[256];
shared uint coarse[16];

void main() {
  uvec2 local = gl_LocalInvocationID.xy, block = gl_GlobalInvocationID.xy;
  uint deepest = 0;
  for (uint i = 0; i < 16; ++i) {
    uvec2 cell = 4 * block + uvec2(i & 3, i >> 2);
    deepest = max(deepest, depths[cell.y * push.cells + cell.x]);
  }
  depths[levelStart(1) + block.y * levelSide(1) + block.x] = deepest;
  fine[16 * local.y + local.x] = deepest;
  barrier();
  uint i = gl_LocalInvocationIndex;
  if (i < 16) {
    uvec2 at = uvec2(i & 3, i >> 2);
    deepest = 0;
    for (uint k = 0; k < 16; ++k) deepest = max(deepest, fine[16 * (4 * at.y + (k >> 2)) + 4 * at.x + (k & 3)]);
    uvec2 parent = 4 * gl_WorkGroupID.xy + at;
    depths[levelStart(2) + parent.y * levelSide(2) + parent.x] = deepest;
    coarse[i] = deepest;
  }
  barrier();
  if (i == 0) {
    deepest = 0;
    for (uint k = 0; k < 16; ++k) deepest = max(deepest, coarse[k]);
    depths[levelStart(3) + gl_WorkGroupID.y * levelSide(3) + gl_WorkGroupID.x] = deepest;
    atomicMax(depths[greatestDepth()], deepest);
  }
}
