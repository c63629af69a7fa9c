#version 460
// One level of a mip chain: every texel is the mean of the area that it covers of the level before, which is a whole
// number of texels only where that level's size is even.
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D finer;
layout(binding = 1) writeonly uniform image2D coarser;

void main() {
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy), size = imageSize(coarser), fine = textureSize(finer, 0);
  if (any(greaterThanEqual(texel, size))) return;
  // In units of which a texel of the level before has `size`, and one of this level `fine`.
  ivec2 low = texel * fine, high = low + fine;
  vec4 sum = vec4(0.0);
  float texel_area = float(fine.x) * float(fine.y);
  for (int y = low.y / size.y; y * size.y < high.y; ++y) {
    for (int x = low.x / size.x; x * size.x < high.x; ++x) {
      ivec2 first = ivec2(x, y) * size, covered = min(first + size, high) - max(first, low);
      // Warped moments come close to the largest number: divide before the sum.
      sum += float(covered.x) * float(covered.y) / texel_area * texelFetch(finer, ivec2(x, y), 0);
    }
  }
  imageStore(coarser, texel, sum);
}
