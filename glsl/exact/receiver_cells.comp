#version 460
// Places every pixel's receiver in the light's grid, and finds for each cell the greatest depth of its receivers. Pixels
// whose visibility needs no caster are decided here. With STEP as LIST, pixels whose light may reach below their own
// plane are listed.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "common/receiver.glsl"
#include "grid.glsl"
#include "grid_receiver.glsl"
#include "common/pixel_steps.glsl"

layout(binding = 6, scalar) buffer Depths { uint depths[]; };
layout(binding = 7, scalar) writeonly buffer Receivers { vec3 receivers[]; };

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  bool listed = false;
  if (all(lessThan(pixel, ivec2(view.size)))) {
    uint index = uint(pixel.y) * view.size.x + uint(pixel.x);
    GridReceiver g;
    float decided;
    if (gridReceiver(pixel, receiverAt(pixel), g, decided)) {
      imageStore(visibility, pixel, vec4(decided));
      receivers[index] = NO_RECEIVER;
    } else {
      uint depth = orderedBits(g.depth), cell = cellOf(g.ndc);
      if (depths[cell] < depth) atomicMax(depths[cell], depth);
      listed = STEP == LIST && g.grazing;
      receivers[index] = listed ? NO_RECEIVER : vec3(g.ndc, g.depth);
    }
  }
  [[dont_unroll]] for (; listed; listed = false) APPEND_PIXEL(list, pixel)
}
