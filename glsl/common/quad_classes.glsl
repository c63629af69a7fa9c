// Classes of 2 x 2 pixels at once, for the dispatch that lists the pixels in penumbrae: their search windows overlap, so
// one look at the depths under all four serves them all. A pixel's class is never wrong, but may be HSM_PENUMBRA where its
// own window would have decided it.
// Include after common/hsm.glsl and common/pixel_steps.glsl. Each thread works on the quad of quadCorner and passes the
// classes to finishQuad.
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

// Classifies the pixels of a quad. `nearest_blocker` is that of searchWindow, `margin` that of classify.
ivec4 classifyQuad(sampler2D hsm, sampler2D blocks, Quad q, AreaLight a, bool nearest_blocker, float margin) {
  ivec4 found = q.found;
  vec2 half_width[4];
  [[unroll]] for (int i = 0; i < 4; ++i) {
    if (found[i] == HSM_PENUMBRA) half_width[i] = max(searchHalfWidth(a, q.r[i].z, a.near), q.least[i]);
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
      found[i] = classifyBounds(q.r[i], bounds, first, last);
      if (k + 1 < rounds) half_width[i] = max(searchHalfWidth(a, q.r[i].z, nearest), q.least[i]);
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
    if (found[k] == HSM_PENUMBRA) found[k] = classifyBlocks(blocks, own, width, margin);
  }
  return found;
}

shared uint open_tiles; // bits of the workgroup's tiles with a listed pixel

// First of the 2 x 2 pixels of the thread, in a dispatch with one thread for each such quad: a workgroup has 2 x 2
// tiles, one after the other.
ivec2 quadCorner() {
  uint tile = gl_LocalInvocationIndex / 16, quad = gl_LocalInvocationIndex % 16;
  return ivec2(16 * gl_WorkGroupID.xy + 8 * uvec2(tile % 2, tile / 2) + 2 * uvec2(quad % 4, quad / 4));
}

// Stores the visibility of the decided pixels of a quad, and appends the others to the list. All threads of the workgroup
// must call it.
void finishQuad(ivec2 corner, ivec4 found) {
  [[unroll]] for (int i = 0; i < 4; ++i) {
    ivec2 pixel = quadPixel(corner, i);
    if (found[i] != HSM_PENUMBRA && all(lessThan(pixel, ivec2(view.size)))) imageStore(visibility, pixel, vec4(found[i]));
  }
  bvec4 left = equal(found, ivec4(HSM_PENUMBRA));
  if (gl_LocalInvocationIndex == 0) open = open_tiles = 0;
  barrier();
  uint number = uint(left.x) + uint(left.y) + uint(left.z) + uint(left.w), index;
  if (number > 0) {
    index = atomicAdd(open, number);
    atomicOr(open_tiles, 1u << gl_LocalInvocationIndex / 16);
  }
  barrier();
  if (gl_LocalInvocationIndex == 0 && open > 0) {
    first = atomicAdd(list.count, open);
    atomicAdd(list.tiles, bitCount(open_tiles));
    atomicMax(list.groups[0], min((first + open + 63) / 64, MAX_TILE_GROUPS));
  }
  barrier();
  index += first;
  for (int i = 0; i < 4; ++i) {
    if (left[i]) list.pixels[index++] = packTile(uvec2(quadPixel(corner, i)));
  }
}

#endif
