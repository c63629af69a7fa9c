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

// A normal in a number that 32 bits of floating point hold exactly: 12 bits along both octahedral axes.
float packNormal(vec3 normal) {
  uvec2 e = uvec2((0.5 * octahedralEncode(normal) + 0.5) * 4095.0 + 0.5);
  return float(e.x | e.y << 12);
}
vec3 unpackNormal(float packed) {
  uint e = uint(packed);
  return octahedralDecode(vec2(e & 0xfffu, e >> 12 & 0xfffu) * (2.0 / 4095.0) - 1.0);
}

#endif
