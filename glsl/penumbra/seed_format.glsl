// How seeds are kept in their image.
#ifndef EDGESHADE_SEED_FORMAT
#define EDGESHADE_SEED_FORMAT
#include "lib/octahedral.glsl"

// In the image of seeds, at their own pixels: a point of the edge in camera view space, and the normal there.
uvec4 packSeed(vec3 point, vec3 normal) {
  return uvec4(floatBitsToUint(point), packSnorm2x16(octahedralEncode(normal)));
}
vec3 seedPoint(uvec4 seed) { return uintBitsToFloat(seed.xyz); }
vec3 seedNormal(uvec4 seed) { return octahedralDecode(unpackSnorm2x16(seed.w)); }

#endif
