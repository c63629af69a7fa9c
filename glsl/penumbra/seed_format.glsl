// Encoding of seeds in their image. Include after lib/octahedral.glsl.
#ifndef EDGESHADE_SEED_FORMAT
#define EDGESHADE_SEED_FORMAT

// Packs a seed for its pixel: a point of the edge in camera view space, and the normal there.
uvec4 packSeed(vec3 point, vec3 normal) {
  return uvec4(floatBitsToUint(point), packSnorm2x16(octahedralEncode(normal)));
}
vec3 seedPoint(uvec4 seed) { return uintBitsToFloat(seed.xyz); }
vec3 seedNormal(uvec4 seed) { return octahedralDecode(unpackSnorm2x16(seed.w)); }

// Packs a normal into the bits of a float: 15 along each octahedral axis. The bit above them is the inverse of the
// last, so that the float is neither subnormal nor NaN and an image stores it unchanged.
float packNormal(vec3 normal) {
  uvec2 e = uvec2((0.5 * octahedralEncode(normal) + 0.5) * 32767.0 + 0.5);
  uint bits = e.x | e.y << 15;
  return uintBitsToFloat(bits | (~bits & 0x20000000u) << 1);
}
vec3 unpackNormal(float packed) {
  uint bits = floatBitsToUint(packed);
  return octahedralDecode(vec2(bits & 0x7fffu, bits >> 15 & 0x7fffu) * (2.0 / 32767.0) - 1.0);
}

#endif
