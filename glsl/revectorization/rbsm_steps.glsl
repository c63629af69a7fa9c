// Steps of rbsm.comp and rbsm_branches.comp. With BY_TILES, a tile is decided whole if the depth bounds of the map's blocks
// say that all its pixels find the same test at their texels and the neighbours of these. The image is the same.
// Include after common/rbsm_receiver.glsl, common/pixel_steps.glsl, common/quad_classes.glsl and common/tile_classes.glsl.
#ifndef EDGESHADE_RBSM_STEPS
#define EDGESHADE_RBSM_STEPS

layout(constant_id = 6) const bool BY_TILES = false; // STEP LIST works on the tiles that STEP TILES left

layout(binding = 6) uniform sampler2D blocks; // depth_bounds.comp; read if STEP is TILES

// Decides the tile of a thread, or lists it.
void decideTile() {
  ivec2 corner = 8 * ivec2(gl_GlobalInvocationID.xy);
  int found = classifyKernels(blocks, corner, push.normal_offset, push.depth_bias, FIXED ? 0.0 : push.slack, FIXED, 1.0);
  storeTile(visibility, corner, found);
  listTile(corner, found);
}

// A thread works on 2 x 2 pixels of open tiles, because a CPU driver takes long to read their list; otherwise on one pixel.
const int PIXELS = BY_TILES && STEP == LIST ? 4 : 1;

// The thread's first pixel. A workgroup works on four tiles, and no image that is worked on by tiles has more of them than
// that.
ivec2 firstPixel() { return PIXELS == 4 ? quadCorner(firstOpenTile()) : ivec2(gl_GlobalInvocationID.xy); }

// Lists a pixel if it is `left`. It does so one by one, since barriers cost a CPU driver more, and in a loop, which such a
// driver leaves if no thread has a pixel to list; it would execute a branch.
void listLeft(ivec2 pixel, bool left) {
  [[dont_unroll]] for (bool lists = STEP == LIST && left; lists; lists = false) APPEND_PIXEL(list, pixel)
}

#endif
