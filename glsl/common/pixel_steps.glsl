// How a pass goes over the image that decides most pixels cheaply: the others are worked on at once, or listed by one
// dispatch and worked on by a second, of which every thread then has work: the same image. MEASURED is the second for a list
// of which another pass knows more already. The includer defines the function declared here, and includes view.glsl before.
#ifndef EDGESHADE_PIXEL_STEPS
#define EDGESHADE_PIXEL_STEPS
#include "tiles.glsl"

const int AT_ONCE = 0, LIST = 1, LISTED = 2, MEASURED = 3;
layout(constant_id = 4) const int STEP = AT_ONCE;

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 4) writeonly uniform image2D visibility;
layout(binding = 5, scalar) buffer PixelList {
  uint groups[3];
  uint count;
  uint tiles; // with any pixel in the list
  uint pixels[];
} list;

// Finds the visibility of a pixel: always, or with STEP == LIST only where that is cheap. False if the pixel is left for later.
bool visibilityAt(ivec2 pixel, out float v);

shared uint open;
shared uint first;

void main() {
  if (STEP == LISTED || STEP == MEASURED) {
    uint threads = 64 * gl_NumWorkGroups.x;
    for (uint i = 64 * gl_WorkGroupID.x + gl_LocalInvocationIndex; i < list.count; i += threads) {
      ivec2 pixel = unpackTile(list.pixels[i]);
      float v;
      visibilityAt(pixel, v);
      imageStore(visibility, pixel, vec4(v));
    }
    return;
  }
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  bool inside = all(lessThan(pixel, ivec2(view.size)));
  float v;
  bool decided = !inside || visibilityAt(pixel, v);
  if (inside && decided) imageStore(visibility, pixel, vec4(v));
  if (STEP == AT_ONCE) return;

  if (gl_LocalInvocationIndex == 0) open = 0;
  barrier();
  uint index;
  if (!decided) index = atomicAdd(open, 1);
  barrier();
  if (gl_LocalInvocationIndex == 0 && open > 0) {
    first = atomicAdd(list.count, open);
    atomicAdd(list.tiles, 1);
    atomicMax(list.groups[0], min((first + open + 63) / 64, MAX_TILE_GROUPS));
  }
  barrier();
  if (!decided) list.pixels[first + index] = packTile(uvec2(pixel));
}

#endif
