// The pixels at a shadow edge: edge_pixels.comp lists them, edge_seeds.comp works on them.
// Include after edge_seeds.glsl.
#ifndef EDGESHADE_EDGE_PIXELS
#define EDGESHADE_EDGE_PIXELS

layout(constant_id = 2) const bool AT_PIXELS = false;

layout(binding = 3) uniform sampler2D hard;

ivec2 neighbour(int i) {
  int row = int(i > 2) + int(i > 5); // a division is slow on some devices
  return ivec2(i - 3 * row, row) - 1;
}

// Neighbours whose hard visibility differs from the pixel's: bit i for neighbour(i). Outside the image the sampler's
// border is lit; later checks leave out such neighbours, which have no surface.
uint differingNeighbours(ivec2 pixel) {
  float own = texelFetch(hard, pixel, 0).x;
  uint differing = 0;
  // Four blocks of 2 x 2 pixels that meet in the pixel. At the common corner of a block, rounding cannot select other
  // pixels. Gather order: (0, 1), (1, 1), (1, 0), (0, 0).
  for (int y = 0; y <= 1; ++y) {
    for (int x = 0; x <= 1; ++x) {
      vec4 block = textureGather(hard, vec2(pixel + ivec2(x, y)) / vec2(view.size));
      uint bits = uint(block.w != own) | uint(block.z != own) << 1 | uint(block.x != own) << 3 | uint(block.y != own) << 4;
      differing |= bits << (x + 3 * y);
    }
  }
  return differing;
}

// The same for neighbours across a side of a lit pixel; 0 if the pixel is in shadow. Two of the blocks hold them all.
uint differingSides(ivec2 pixel) {
  vec4 before = textureGather(hard, vec2(pixel) / vec2(view.size));
  vec4 after = textureGather(hard, vec2(pixel + 1) / vec2(view.size));
  float own = before.y;
  uint differing =
      uint(before.z != own) << 1 | uint(before.x != own) << 3 | uint(after.z != own) << 5 | uint(after.x != own) << 7;
  return own > 0.5 ? differing : 0;
}

// Bits of the neighbours that a seed at the pixel differs from; 0 if the pixel is not a seed. Both sides of an edge have
// the same half-way points, so seeds on the lit side suffice. Neighbours across a corner add nothing then: if no
// neighbour across a side differs, the edge also runs between two other pixels.
uint edgeNeighbours(ivec2 pixel) { return AT_PIXELS ? differingNeighbours(pixel) : differingSides(pixel); }

#endif
