// The dispatches of rbsm.comp and rbsm_branches.comp. With BY_TILES, a tile is decided whole if the depth bounds of the map's
// blocks say that all its pixels find the same test at their texels and the neighbours of these. The image is the same.
// Include last; the shader defines visibilityAt before.
#ifndef EDGESHADE_RBSM_STEPS
#define EDGESHADE_RBSM_STEPS
#include "common/soft_receiver.glsl"
#include "lib/pcf.glsl"
#include "common/pcf_bounds.glsl"
#include "common/hsm.glsl"
#include "common/quad_classes.glsl"
#include "common/tile_classes.glsl"

layout(constant_id = 6) const bool BY_TILES = false; // STEP LIST works on the tiles that STEP TILES left

layout(binding = 6) uniform sampler2D blocks; // depth_bounds.comp; read if STEP is TILES

// Lists pixels one by one: barriers cost a CPU driver more. It leaves the loop if no thread has a pixel to list, but would
// execute a branch.
void workOn(ivec2 pixel) {
  float v;
  bool inside = all(lessThan(pixel, ivec2(view.size)));
  bool decided = inside && visibilityAt(pixel, v);
  if (decided) imageStore(visibility, pixel, vec4(v));
  [[dont_unroll]] for (bool left = STEP == LIST && inside && !decided; left; left = false) APPEND_PIXEL(list, pixel)
}

void main() {
  if (readsList()) {
    for (uint i = firstListed(); i < list.count; i += listStride()) {
      ivec2 pixel = unpackTile(list.pixels[i]);
      float v;
      visibilityAt(pixel, v);
      imageStore(visibility, pixel, vec4(v));
    }
    return;
  }
  if (STEP == TILES) {
    ivec2 corner = 8 * ivec2(gl_GlobalInvocationID.xy);
    int found = classifyKernels(blocks, corner, push.normal_offset, push.depth_bias, FIXED ? 0.0 : push.slack, FIXED, 1.0);
    storeTile(visibility, corner, found);
    listTile(corner, found);
    return;
  }
  if (BY_TILES && STEP == LIST) {
    // A thread works on 2 x 2 pixels: a CPU driver takes long to read the list.
    // Four tiles a workgroup: no image that is worked on in this way has more than that.
    ivec2 corner = quadCorner(firstOpenTile());
    [[unroll]] for (int i = 0; i < 4; ++i) workOn(quadPixel(corner, i));
    return;
  }
  workOn(ivec2(gl_GlobalInvocationID.xy));
}

#endif
