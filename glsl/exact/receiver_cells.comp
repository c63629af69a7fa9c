#version 460
// Finds for each cell of the light's grid the greatest depth of the receivers that the camera sees in it.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "grid.glsl"
#include "grid_receiver.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 3, scalar) buffer Depths { uint depths[]; };

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, ivec2(view.size)))) return;
  GridReceiver g;
  float decided;
  if (gridReceiver(pixel, receiverAt(pixel), g, decided)) return;
  uint depth = orderedBits(g.depth);
  if (depths[g.cell] < depth) atomicMax(depths[g.cell], depth);
}
