// Encoding of seeds: 12 bytes for each pixel. Include after common/receiver.glsl.
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
uint packNormalAndLine(Seed seed) {
  ivec2 e = ivec2(round(octahedralEncode(seed.normal) * 1023.0));
  vec3 t, b;
  tangents(octahedralDecode(vec2(e) / 1023.0), t, b);
  vec2 d = vec2(dot(seed.along, t), dot(seed.along, b));
  float sum = abs(d.x) + abs(d.y);
  int code = sum > 0.0 ? int(round(511.0 * (d.y < 0.0 ? -d.x : d.x) / sum)) : NO_DIRECTION;
  return uint(e.x & 0x7ff) | uint(e.y & 0x7ff) << 11 | uint(code) << 22;
}

// Device coordinates of the points at the depth z in view space: xy = scale (axes * ndc + origin).
struct DepthPlane {
  mat2 axes;
  vec2 origin;
  float scale;
};

// No branch depends on the frame's constants alone (common/receiver.glsl): both projections are computed.
DepthPlane depthPlane(float z) {
  mat4 m = view.view_from_clip;
  bool perspective = m[2][3] != 0.0;
  // Depths of a parallel projection may be those of a tilted plane.
  vec2 tilt = m[2].xy / m[2].z, k = perspective ? vec2(0.0) : tilt;
  float of_perspective = z / m[3].z, of_parallel = 1.0 / m[3].w;
  vec2 shift = k * (z * m[3].w - m[3].z);
  return DepthPlane(mat2(m[0].xy - k * m[0].z, m[1].xy - k * m[1].z), m[3].xy + shift, perspective ? of_perspective : of_parallel);
}

vec2 pixelCentre(ivec2 pixel) { return (2.0 * vec2(pixel) + 1.0) / vec2(view.size) - 1.0; }

// Offset from a pixel's centre, in pixels, of the place in the image that shows a point.
vec2 pixelsFrom(ivec2 pixel, vec3 p) {
  DepthPlane plane = depthPlane(p.z);
  vec2 apart = p.xy / plane.scale - plane.origin - plane.axes * pixelCentre(pixel);
  return 0.5 * (inverse(plane.axes) * apart) * vec2(view.size);
}

// The seed of a pixel: normal and line; the point's offset from the pixel in the image, at most a pixel along each axis;
// and its depth in view space.
uvec3 packSeed(ivec2 pixel, Seed seed) {
  uint offset = packSnorm2x16(pixelsFrom(pixel, seed.point));
  return uvec3(packNormalAndLine(seed), offset, floatBitsToUint(seed.point.z));
}

// Index of a pixel's seed in their buffer.
uint seedIndex(ivec2 pixel) { return uint(pixel.x) + view.size.x * uint(pixel.y); }

vec3 seedPoint(ivec2 pixel, uvec3 seed) {
  float z = uintBitsToFloat(seed.z);
  DepthPlane plane = depthPlane(z);
  // The same in every pipeline, so that skipping changes no bit.
  precise vec2 ndc = pixelCentre(pixel) + unpackSnorm2x16(seed.y) * (2.0 / vec2(view.size));
  precise vec2 place = plane.scale * (plane.axes[0] * ndc.x + plane.axes[1] * ndc.y + plane.origin);
  return vec3(place, z);
}

vec3 seedNormal(uvec3 seed) {
  int bits = int(seed.x);
  return octahedralDecode(vec2(bitfieldExtract(bits, 0, 11), bitfieldExtract(bits, 11, 11)) / 1023.0);
}

Seed unpackSeed(ivec2 pixel, uvec3 seed) {
  Seed s = Seed(seedPoint(pixel, seed), seedNormal(seed), vec3(0.0));
  vec3 t, b;
  tangents(s.normal, t, b);
  int code = int(seed.x) >> 22;
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
