// Dispatches of a pass that decides most pixels cheaply and works longer on the others. AT_ONCE does both in one
// dispatch. LIST decides the cheap pixels and lists the others; LISTED then works on the list, so that every thread has
// work. The image is the same. MEASURED is LISTED for a list whose pixels another pass has measured already. TILES decides
// whole tiles and lists the others; LIST then works on these tiles (common/quad_classes.glsl), or OPEN_TILES works on all
// of their pixels at once, without a list of pixels. LONE_TILES is TILES for OPEN_TILES.
// The shader's main walks over the pixels with the functions below.
// Include after common/receiver.glsl.
#ifndef EDGESHADE_PIXEL_STEPS
#define EDGESHADE_PIXEL_STEPS
#include "tiles.glsl"

const int AT_ONCE = 0, LIST = 1, LISTED = 2, MEASURED = 3, TILES = 4, OPEN_TILES = 5, LONE_TILES = 6;
layout(constant_id = 4) const int STEP = AT_ONCE;
// Pixels that each thread of the dispatch over the list works on, one after the other; tiles, if this is OPEN_TILES.
layout(constant_id = 11) const uint TOGETHER = 1;

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 4) writeonly uniform image2D visibility;
layout(binding = 5, scalar) buffer PixelList {
  uint groups[3];
  uint count;
  uint tiles; // number of tiles with a listed pixel
  uint pixels[];
} list;

// Number of workgroups for a list of pixels, of which each thread works on `together`.
uint groupsOf(uint pixels, uint together) { return min((pixels + 64 * together - 1) / (64 * together), MAX_TILE_GROUPS); }
uint groupsOf(uint pixels) { return groupsOf(pixels, TOGETHER); }

// Appends a pixel to the list that another pass works on, `together` of them in each thread; `to` is declared as PixelList
// is. The first pixel of every 64 adds a tile, since the pixels are not listed by tiles.
#define APPEND_PIXEL_OF(to, pixel, together)                       \
  {                                                                \
    uint index = atomicAdd(to.count, 1);                           \
    to.pixels[index] = packTile(uvec2(pixel));                     \
    if (index % 64 == 0) {                                         \
      atomicAdd(to.tiles, 1);                                      \
      atomicMax(to.groups[0], groupsOf(index + 1, together));      \
    }                                                              \
  }
#define APPEND_PIXEL(to, pixel) APPEND_PIXEL_OF(to, pixel, TOGETHER)

shared uint open;
shared uint first;

// Returns true in the dispatches that decide whole tiles.
bool decidesTiles() { return STEP == TILES || STEP == LONE_TILES; }

// Returns true in the dispatches that work on the list.
bool readsList() { return STEP == LISTED || STEP == MEASURED; }

// Index in the list of the thread's first pixel, and the step to its next one.
uint firstListed() { return 64 * gl_WorkGroupID.x + gl_LocalInvocationIndex; }
uint listStride() { return 64 * gl_NumWorkGroups.x; }

// Appends the pixel to the list if it is `left` and STEP makes a list. All threads of the workgroup must call it.
void listPixel(ivec2 pixel, bool left) {
  if (STEP != LIST) return;
  if (gl_LocalInvocationIndex == 0) open = 0;
  barrier();
  uint index;
  if (left) index = atomicAdd(open, 1);
  barrier();
  if (gl_LocalInvocationIndex == 0 && open > 0) {
    first = atomicAdd(list.count, open);
    atomicAdd(list.tiles, 1);
    atomicMax(list.groups[0], groupsOf(first + open));
  }
  barrier();
  if (left) list.pixels[first + index] = packTile(uvec2(pixel));
}

#endif
