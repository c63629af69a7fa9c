#version 460
// Writes the stencil value plus 1000 times the count of quads_count.frag.
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform usampler2D stencil;
layout(binding = 1, scalar) readonly buffer Counts { uint counts[]; };
layout(binding = 2, r32ui) writeonly uniform uimage2D result;

void main() {
  ivec2 p = ivec2(gl_GlobalInvocationID.xy);
  ivec2 size = imageSize(result);
  if (any(greaterThanEqual(p, size))) return;
  imageStore(result, p, uvec4(texelFetch(stencil, p, 0).r + 1000 * counts[p.y * size.x + p.x]));
}
