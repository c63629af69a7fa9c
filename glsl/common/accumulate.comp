#version 460
// Adds one hard shadow to the count of lit samples. The average over many samples of an area light is the papers' own
// ground truth.
// The counts are integers, so the order of the samples does not matter. The last sample divides by their number.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform sampler2D sample_visibility;
layout(binding = 1, r32ui) uniform uimage2D lit_count;
layout(binding = 2) writeonly uniform image2D visibility;

layout(push_constant, scalar) uniform Push {
  uvec2 size;
  uint index; // number of this sample
  uint count; // number of all samples
} push;

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(uvec2(pixel), push.size))) return;
  uint lit = push.index == 0 ? 0u : imageLoad(lit_count, pixel).x;
  if (texelFetch(sample_visibility, pixel, 0).x >= 0.5) lit += 1u;
  imageStore(lit_count, pixel, uvec4(lit));
  if (push.index + 1 == push.count) imageStore(visibility, pixel, vec4(float(lit) / float(push.count)));
}
