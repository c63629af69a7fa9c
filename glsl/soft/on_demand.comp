#version 460
// Empties dispatches whose result no pixel needs: those that make the depth pyramid for a list of pixels.
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 1) in;

layout(binding = 0, scalar) readonly buffer PixelList {
  uint groups[3];
  uint count;
} list;
layout(binding = 1, scalar) buffer Groups { uvec4 groups[]; }; // dispatch arguments, and a word between them

void main() {
  for (int i = 0; i < groups.length(); ++i) {
    if (list.count == 0) groups[i].x = 0;
  }
}
