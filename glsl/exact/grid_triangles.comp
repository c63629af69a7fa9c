#version 460
// Projects the casters' triangles and pairs each with the blocks of cells that it may cover. With FACES, triangles whose
// planes cut the light are listed.
#extension GL_GOOGLE_include_directive : require
#include "caster_edges/casters.glsl"
#include "grid.glsl"
#include "grid_triangle.glsl"
#include "caster_lists.glsl"

layout(constant_id = 0) const bool FACES = false;

layout(local_size_x = 64) in;

layout(binding = 3, scalar) readonly buffer Positions { float positions[]; };
layout(binding = 4, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(binding = 5, scalar) readonly buffer Chunks { uint chunks[]; }; // instance of each workgroup
layout(binding = 6, scalar) readonly buffer Instances { CasterInstance instances[]; };
layout(binding = 7, scalar) readonly buffer Lights { CasterLight lights[]; };
layout(binding = 8, scalar) readonly buffer Facing { uint facing[]; };
layout(binding = 9, scalar) writeonly buffer GridTriangles { GridTriangle grid_triangles[]; };
layout(binding = 10, scalar) buffer FaceList {
  uint groups[3]; // dispatch arguments for 64 sides of faces per workgroup
  uint count;
  uint bits[];    // indices of the faces' facing bits
} faces;
layout(binding = 11, scalar) writeonly buffer FacePlanes { vec4 face_planes[]; };

vec4 clipOf(uint v, mat4 m) {
  uint i = v * push.stride;
  precise vec4 q = m * vec4(positions[i], positions[i + 1], positions[i + 2], 1.0);
  return q;
}

vec3 cross3(vec3 a, vec3 b) {
  precise vec3 c = vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  return c;
}

// Relative error of a vertex in the light's space, and of what is computed from it.
const float VERTEX_ULPS = 4.0 / 8388608.0;

bool before(vec3 a, vec3 b) { return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z; }

// The line through two points. It depends on neither their order nor the triangle; `along` tells which order the line
// has.
vec3 lineThrough(vec3 a, vec3 b, out bool along) {
  along = before(a, b);
  vec3 from = along ? a : b, to = along ? b : a;
  precise vec3 line = cross3(from, to - from);
  precise float largest = max(max(abs(line.x), abs(line.y)), abs(line.z));
  precise vec3 scaled = largest > 0.0 ? line / largest : vec3(0.0);
  return scaled;
}

// A corner in the space in which the triangle's plane does not depend on the projection: (x, y, w) for a spot,
// (x, y, z) for a sun.
vec3 cornerOf(vec4 q) { return push.spot != 0 ? q.xyw : q.xyz; }

// Turns the corners so that the longest side lies opposite the first: the other two sides then determine the plane of
// a sliver best.
void turnCorners(inout vec4 a, inout vec4 b, inout vec4 c) {
  float ab = distance(cornerOf(a), cornerOf(b)), bc = distance(cornerOf(b), cornerOf(c)), ca = distance(cornerOf(c), cornerOf(a));
  vec4 first = a;
  if (ca >= max(ab, bc)) {
    a = b;
    b = c;
    c = first;
  } else if (ab >= bc) {
    a = c;
    c = b;
    b = first;
  }
}

// Returns false for a triangle that covers nothing: one that is seen edge-on, lies behind the light, or has numbers
// that are not finite.
bool project(vec4 a, vec4 b, vec4 c, out GridTriangle t, out vec2 low, out vec2 high) {
  bool spot = push.spot != 0;
  vec3 p[3] = vec3[](a.xyw, b.xyw, c.xyw);
  precise vec3 ab = cornerOf(b) - cornerOf(a), ac = cornerOf(c) - cornerOf(a), normal = cross3(ab, ac);
  precise float from_light = dot(normal, a.xyw);
  float volume = spot ? from_light : normal.z;
  for (int i = 0; i < 3; ++i) t.lines[i] = vec3(0.0);
  t.plane = vec3(0.0);
  t.inner = 0;
  t.range = vec2(0.0);
  low = vec2(-1.0);
  high = vec2(1.0);
  vec3 w = vec3(a.w, b.w, c.w), z = vec3(a.z, b.z, c.z);
  if (!(abs(volume) > 0.0) || isinf(volume) || all(lessThan(w, vec3(push.nearest)))) return false;
  for (int i = 0; i < 3; ++i) {
    bool along;
    t.lines[i] = lineThrough(p[i], p[(i + 1) % 3], along);
    if (along == (volume > 0.0)) t.inner |= 1u << i;
  }
  bool whole = all(greaterThanEqual(w, vec3(push.nearest)));
  // Plane and corners move away from the light by the bound of their error: that of the corners, and that of a sliver's
  // normal over its length.
  float extent = max(length(cornerOf(a)), max(length(cornerOf(b)), length(cornerOf(c))));
  float sliver = length(ab) * length(ac) / length(normal);
  float off = VERTEX_ULPS * (extent + sliver * (length(ab) + length(ac))) * length(normal) / abs(volume);
  float closer = 1.0 - min(off, 1.0);
  vec3 of_spot = -normal / volume * closer;
  vec2 spot_range = vec2(-1.0 / min(w.x, min(w.y, w.z)), -1.0 / max(w.x, max(w.y, w.z))) * closer;
  if (!whole) spot_range.x = -3.0e38;
  precise vec2 slope = -normal.xy / volume;
  precise float at_middle = a.z - (slope.x * a.x + slope.y * a.y);
  vec3 of_sun = vec3(slope, at_middle + off);
  vec2 sun_range = vec2(min(z.x, min(z.y, z.z)), max(z.x, max(z.y, z.z))) + off;
  // Both are computed, and no branch depends on the frame's constants alone (common/receiver.glsl).
  t.plane = spot ? of_spot : of_sun;
  t.range = spot ? spot_range : sun_range;
  if (any(isinf(t.plane)) || any(isnan(t.plane))) return false;
  if (whole) {
    vec2 u = a.xy / a.w, v = b.xy / b.w, q = c.xy / c.w;
    low = min(u, min(v, q));
    high = max(u, max(v, q));
  }
  return true;
}

// The plane of a face whose plane cuts the light, in a form that is positive on the side of the light's centre:
// dot(plane, (ndc, 1, depth)). Returns false for other faces.
//
// The bit that says whether the face is seen from its front decides which side that is. If the centre lies in the plane
// to within rounding, either side is right, but all sides of the face must take the same one.
bool cutsLight(vec4 a, vec4 b, vec4 c, bool front, out vec4 plane) {
  bool spot = push.spot != 0;
  precise vec3 ab = cornerOf(b) - cornerOf(a), ac = cornerOf(c) - cornerOf(a), n = cross3(ab, ac);
  precise float from_light = dot(n, a.xyw);
  precise float from_middle = -dot(n, a.xyz);
  float volume = spot ? from_light : n.z;
  plane = spot ? vec4(n, volume) : vec4(n.xy, from_middle, volume);
  float largest = max(max(abs(plane.x), abs(plane.y)), max(abs(plane.z), abs(plane.w)));
  float rounding = VERTEX_ULPS * length(n) * (spot ? length(a.xyw) : 1.0);
  if (!(largest > 0.0) || isinf(largest) || abs(volume) > 1.001 * dot(abs(n.xy), push.kappa) + rounding) return false;
  plane *= (front == (push.mirrored > 0.0) ? 1.0 : -1.0) / largest;
  return true;
}

void listFace(uint bit, vec4 plane) {
  uint i = atomicAdd(faces.count, 1);
  if (i >= push.faces) return;
  faces.bits[i] = bit;
  face_planes[i] = plane;
  atomicMax(faces.groups[0], (3 * i + 66) / 64);
}

void main() {
  uint chunk = chunkIndex(gl_WorkGroupID), local = gl_LocalInvocationIndex;
  if (chunk >= push.chunks) return;
  uint instance = chunks[chunk];
  CasterInstance info = instances[instance];
  uint t = CHUNK * (chunk - info.first_triangle_chunk) + local;
  if (t >= info.triangles || lights[instance].casts == 0) return;
  uint bit = CHUNK * chunk + local;
  bool front = (facing[bit >> 5] >> (bit & 31u) & 1u) != 0;
  // The shadow of a closed mesh is that of its front faces.
  bool counts = lights[instance].shell == 0 || front == (lights[instance].orientation > 0.0);
  if (!counts && !FACES) return;
  uvec3 corners = triangles[info.first_triangle + t];
  mat4 m = lights[instance].clip_from_object;
  GridTriangle g;
  vec2 low, high;
  vec4 a = clipOf(corners.x, m), b = clipOf(corners.y, m), c = clipOf(corners.z, m);
  turnCorners(a, b, c);
  vec4 plane;
  if (FACES && cutsLight(a, b, c, front, plane)) listFace(bit, plane);
  if (!counts || !project(a, b, c, g, low, high)) return;
  g.low = low;
  g.high = high;
  grid_triangles[bit] = g;
  // A hundredth of a cell covers the rounding of places.
  vec2 first = floor((0.5 * low + 0.5) * float(push.cells) - 0.01), last = floor((0.5 * high + 0.5) * float(push.cells) + 0.01);
  vec2 most = vec2(float(push.cells));
  appendBlocks(bit, ivec2(clamp(first, vec2(-1.0), most)), ivec2(clamp(last, vec2(-1.0), most)), g.range.x);
}
