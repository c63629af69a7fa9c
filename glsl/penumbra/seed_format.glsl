// Encoding of seeds in their image. Include after lib/octahedral.glsl.
#ifndef EDGESHADE_SEED_FORMAT
#define EDGESHADE_SEED_FORMAT

// Axes that are perpendicular to a normal and to each other, continuous but for the turn at z = 0 (Duff et al. 2017).
void tangents(vec3 n, out vec3 t, out vec3 b) {
  float s = n.z < 0.0 ? -1.0 : 1.0, a = -1.0 / (s + n.z), c = n.x * n.y * a;
  t = vec3(1.0 + s * n.x * n.x * a, s * c, -s * n.x);
  b = vec3(c, s + n.y * n.y * a, -n.y);
}

// A seed: a point of the edge in camera view space, the surface's normal there, and the direction of the edge's line.
// `along` has unit length, or is 0 if the direction is not known.
struct Seed {
  vec3 point;
  vec3 normal;
  vec3 along;
};

// The code of an unknown direction; others are -511 to 511.
const int NO_DIRECTION = -512;

// 11 bits along each octahedral axis of the normal, then 10 for the direction in the plane perpendicular to it. Of the
// two opposite directions of a line, one has a positive component along the second axis; the code is its component
// along the first axis if the absolute values of both add up to 1.
uvec4 packSeed(Seed seed) {
  ivec2 e = ivec2(round(octahedralEncode(seed.normal) * 1023.0));
  vec3 t, b;
  tangents(octahedralDecode(vec2(e) / 1023.0), t, b);
  vec2 d = vec2(dot(seed.along, t), dot(seed.along, b));
  float sum = abs(d.x) + abs(d.y);
  int code = sum > 0.0 ? int(round(511.0 * (d.y < 0.0 ? -d.x : d.x) / sum)) : NO_DIRECTION;
  return uvec4(floatBitsToUint(seed.point), uint(e.x & 0x7ff) | uint(e.y & 0x7ff) << 11 | uint(code) << 22);
}

vec3 seedPoint(uvec4 seed) { return uintBitsToFloat(seed.xyz); }
vec3 seedNormal(uvec4 seed) {
  int bits = int(seed.w);
  return octahedralDecode(vec2(bitfieldExtract(bits, 0, 11), bitfieldExtract(bits, 11, 11)) / 1023.0);
}

Seed unpackSeed(uvec4 seed) {
  Seed s = Seed(seedPoint(seed), seedNormal(seed), vec3(0.0));
  vec3 t, b;
  tangents(s.normal, t, b);
  int code = int(seed.w) >> 22;
  float x = float(code) / 511.0;
  vec2 d = normalize(vec2(x, 1.0 - abs(x)));
  if (code != NO_DIRECTION) s.along = d.x * t + d.y * b;
  return s;
}

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
