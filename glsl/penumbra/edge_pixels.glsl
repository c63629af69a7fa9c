// The pixels at a shadow edge: listed by edge_pixels.comp, worked off by edge_seeds.comp.
#ifndef EDGESHADE_EDGE_PIXELS
#define EDGESHADE_EDGE_PIXELS

layout(constant_id = 2) const bool AT_PIXELS = false;

layout(binding = 3) uniform sampler2D hard;

ivec2 neighbour(int i) {
  int row = int(i > 2) + int(i > 5); // a division is slow on some devices
  return ivec2(i - 3 * row, row) - 1;
}

// The neighbours whose hard visibility is another: bit i for neighbour(i). Outside the image the sampler's border is lit;
// receivers there are none.
uint differingNeighbours(ivec2 pixel, float own) {
  uint differing = 0;
  // Four blocks of 2 x 2 that meet in the pixel; at the common corner of a block no rounding can pick another. Gather order:
  // (0, 1), (1, 1), (1, 0), (0, 0).
  for (int y = 0; y <= 1; ++y) {
    for (int x = 0; x <= 1; ++x) {
      vec4 block = textureGather(hard, vec2(pixel + ivec2(x, y)) / vec2(view.size));
      uint bits = uint(block.w != own) | uint(block.z != own) << 1 | uint(block.x != own) << 3 | uint(block.y != own) << 4;
      differing |= bits << (x + 3 * y);
    }
  }
  return differing;
}

// Those that matter to a seed at the pixel: none where it is none.
uint edgeNeighbours(ivec2 pixel) {
  float own = texelFetch(hard, pixel, 0).x;
  // The points of both sides are the same, so one side will do.
  uint differing = own > 0.5 || AT_PIXELS ? differingNeighbours(pixel, own) : 0;
  // Pairs across a corner say nothing new where one across a side is there; where none is, the edge also runs between two
  // other pixels.
  const uint SIDES = 0xaau;
  return AT_PIXELS ? differing : differing & SIDES;
}

#endif
