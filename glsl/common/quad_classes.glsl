// Classes of 2 x 2 pixels at once, for the dispatches that list the pixels in penumbrae: their search windows overlap, so
// one look at the depths under all four serves them all. A pixel's class is never wrong, but may be HSM_PENUMBRA where its
// own window would have decided it.
// Include after common/hsm.glsl and common/pixel_steps.glsl. Dispatches with STEP TILES decide whole
// tiles (common/tile_classes.glsl) and list the open ones. Dispatches with STEP LIST work on these, four at a time, each
// thread on the quad of quadCorner.
#ifndef EDGESHADE_QUAD_CLASSES
#define EDGESHADE_QUAD_CLASSES
#extension GL_EXT_control_flow_attributes : require

// The pixels (0, 0), (1, 0), (0, 1) and (1, 1) of a quad.
struct Quad {
  ivec4 found;       // HSM_PENUMBRA for a pixel that needs a window, otherwise its class; HSM_LIT outside the image
  SoftReceiver r[4]; // of the pixels that need a window
  vec2 least[4];     // least half-widths of their search windows, uv
};

ivec2 quadPixel(ivec2 corner, int i) { return corner + ivec2(i & 1, i >> 1); }

// Classifies the pixels of a quad. `nearest_blocker` and `reach` are those of searchWindow, `margin` that of classify.
ivec4 classifyQuad(sampler2D hsm, sampler2D blocks, Quad q, AreaLight a, bool nearest_blocker, float reach, float margin) {
  ivec4 found = q.found;
  vec2 half_width[4];
  [[unroll]] for (int i = 0; i < 4; ++i) {
    if (found[i] == HSM_PENUMBRA) half_width[i] = max(searchHalfWidth(a, q.r[i].z, a.near) * reach, q.least[i]);
  }
  // Each round narrows the windows by the nearest depth that the one before found, as searchWindow does. A loop instead
  // of branches: a CPU driver leaves it as soon as no pixel is left.
  int rounds = nearest_blocker ? 3 : 1;
  [[dont_unroll]] for (int k = 0; k < rounds && any(equal(found, ivec4(HSM_PENUMBRA))); ++k) {
    // All windows together.
    ivec2 first = ivec2(0x10000), last = ivec2(-0x10000);
    [[unroll]] for (int i = 0; i < 4; ++i) {
      if (found[i] != HSM_PENUMBRA) continue;
      ivec2 low, high;
      windowRange(q.r[i], half_width[i], margin, low, high);
      first = min(first, low);
      last = max(last, high);
    }
    vec2 bounds = hsmBounds(hsm, first, last);
    float nearest = max(lightDistance(a, bounds.x), a.near);
    [[unroll]] for (int i = 0; i < 4; ++i) {
      if (found[i] != HSM_PENUMBRA) continue;
      found[i] = classifyBounds(q.r[i], bounds, first, last, 0.0);
      if (k + 1 < rounds) half_width[i] = max(searchHalfWidth(a, q.r[i].z, nearest) * reach, q.least[i]);
    }
  }
  [[dont_unroll]] for (int k = 0; k < 4 && any(equal(found, ivec4(HSM_PENUMBRA))); ++k) {
    SoftReceiver own = q.r[0];
    vec2 width = half_width[0];
    [[unroll]] for (int i = 1; i < 4; ++i) {
      if (i != k) continue;
      own = q.r[i];
      width = half_width[i];
    }
    ivec2 first, last;
    windowRange(own, width, margin, first, last);
    if (found[k] == HSM_PENUMBRA) found[k] = classifyBlocks(blocks, own, first, last, 0.0);
  }
  return found;
}

layout(binding = 11, scalar) buffer OpenTiles {
  uint groups[3];
  uint count;
  uint tiles[];
} open_tiles;

// Stores the visibility of a decided tile, whose first pixel is `corner`.
void storeTile(writeonly image2D image, ivec2 corner, int found) {
  // Decided tiles lie in the image (tileReceivers).
  [[dont_unroll]] for (int i = 0; i < (found == HSM_PENUMBRA ? 0 : 64); ++i) imageStore(image, corner + ivec2(i & 7, i >> 3), vec4(found));
}

// Lists an open tile.
void listTile(ivec2 corner, int found) {
  if (found != HSM_PENUMBRA || any(greaterThanEqual(corner, ivec2(view.size)))) return;
  uint i = atomicAdd(open_tiles.count, 1);
  open_tiles.tiles[i] = packTile(uvec2(corner / 8));
  // Tiles a workgroup.
  uint together = STEP == LONE_TILES ? TOGETHER : 4 * TOGETHER;
  if (i % together == 0 && i / together < MAX_TILE_GROUPS) atomicAdd(open_tiles.groups[0], 1);
}

shared uint tiles_left; // bits of the workgroup's tiles with a listed pixel

// First tile in the list of the workgroup, and the step to its next one.
uint firstOpenTile() { return 4 * gl_WorkGroupID.x; }
uint openTileStride() { return 4 * gl_NumWorkGroups.x; }

// First of the 2 x 2 pixels of the thread, where the workgroup works on four open tiles from `first_tile`. It lies outside
// the image if the list ends before.
ivec2 quadCorner(uint first_tile) {
  uint tile = first_tile + gl_LocalInvocationIndex / 16, quad = gl_LocalInvocationIndex % 16;
  if (tile >= open_tiles.count) return ivec2(view.size);
  return 8 * unpackTile(open_tiles.tiles[tile]) + 2 * ivec2(quad % 4, quad / 4);
}

// Tells whether the thread has a pixel in open tile i, and which one. Eight threads in a row work on 4 x 2 pixels, whose
// loops have about as many rounds.
bool openTilePixel(uint i, out ivec2 pixel) {
  int k = int(gl_LocalInvocationIndex);
  pixel = 8 * unpackTile(open_tiles.tiles[i]) + ivec2(k & 3 | k >> 1 & 4, k >> 2 & 1 | k >> 3 & 6);
  return all(lessThan(pixel, ivec2(view.size)));
}

// Stores the visibility of the decided pixels of a quad.
void storeQuad(writeonly image2D image, ivec2 corner, ivec4 found) {
  [[unroll]] for (int i = 0; i < 4; ++i) {
    ivec2 pixel = quadPixel(corner, i);
    if (found[i] != HSM_PENUMBRA && all(lessThan(pixel, ivec2(view.size)))) imageStore(image, pixel, vec4(found[i]));
  }
}

// Appends the open pixels of a quad to the list. All threads of the workgroup must call it.
void listQuad(ivec2 corner, ivec4 found) {
  bvec4 left = equal(found, ivec4(HSM_PENUMBRA));
  if (gl_LocalInvocationIndex == 0) open = tiles_left = 0;
  barrier();
  uint number = uint(left.x) + uint(left.y) + uint(left.z) + uint(left.w), index;
  if (number > 0) {
    index = atomicAdd(open, number);
    atomicOr(tiles_left, 1u << gl_LocalInvocationIndex / 16);
  }
  barrier();
  if (gl_LocalInvocationIndex == 0 && open > 0) {
    first = atomicAdd(list.count, open);
    atomicAdd(list.tiles, bitCount(tiles_left));
    atomicMax(list.groups[0], groupsOf(first + open));
  }
  barrier();
  index += first;
  for (int i = 0; i < 4; ++i) {
    if (left[i]) list.pixels[index++] = packTile(uvec2(quadPixel(corner, i)));
  }
}

#endif
