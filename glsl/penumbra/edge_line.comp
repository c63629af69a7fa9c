#version 460
// Moves the seeds' points from half-way between lit and shadowed pixels to the edge of the hard shadow, and finds the
// direction of the edge's line there. Revectorization draws the edge in a texel as a straight line: its ends follow from
// the run's lengths, or it is a side of the texel. So a step of the search between the pixels that meets a texel with an
// edge is the last one; other steps are bisections. The trial points lie on the pixel's plane. Penumbrae therefore move
// smoothly with the shadow instead of by whole pixels.
// Macedo, Apolinario (2018) do not have this step; their edges are pixels.
#extension GL_GOOGLE_include_directive : require
layout(constant_id = 1) const int MAX_DISTANCE = 16;
#define MAXDIST MAX_DISTANCE
#include "common/receiver.glsl"
#include "common/rbsm_receiver.glsl"
#include "lib/rbsm_profile.glsl"
#include "lib/rbsm_star.glsl"
#include "revectorization/rbsm_function.glsl"
#include "seed_format.glsl"
#include "common/tiles.glsl"

layout(constant_id = 4) const int STEPS = 3;

layout(local_size_x = 64) in;

layout(binding = 4, scalar) readonly buffer PixelList {
  uint groups[3];
  uint count;
  uint pixels[];
} list;
layout(binding = 5, scalar) buffer Seeds { uvec3 seeds[]; };
layout(binding = 6, scalar) readonly buffer SeedBits { uint seed_bits[]; }; // one word per column and 32 rows, bit y % 32

// The hard shadow at a point, and the edge that its texel holds, if any: a function that is linear in the texel, 0 at
// the edge and positive at a point whose visibility is that of its texel.
struct HardEdge {
  float visibility;
  bool found;
  float value;
  vec2 gradient; // per texel
};

// The edge in a texel at a discontinuity: the line of an L shape (lib/rbsm.glsl, lib/rbsm_star.glsl); for shapes that keep
// the shadow test, the nearest side of the texel with a discontinuity.
HardEdge edgeInTexel(ShadowPoint p, float s, vec3 d) {
  vec4 rd = computeFragmentDistanceToSE(p, d);
  vec4 nrd = normalizeFragmentDistanceToSE(rd);
  HardEdge e = HardEdge(s, true, 0.0, vec2(0.0));
  if (nrd.z == 0.0 && nrd.w == 0.0) {
    e.value = nrd.x + nrd.y - (FUNCTION == STAR ? 0.5 : 1.0);
    e.gradient = vec2(rd.x > rd.y ? 1.0 : -1.0, rd.z > rd.w ? -1.0 : 1.0) / (abs(rd.xz) + abs(rd.yw));
    // Silhouette recovery draws lines into lit texels only.
    e.found = FUNCTION == STAR || s > 0.5;
    if (e.found && e.value < 0.0) e.visibility = 1.0 - s;
    return e;
  }
  if (FUNCTION == SILHOUETTE) {
    bool closed = d.x == 0.75 || d.y == 0.75 || nrd.z == 1.0 || nrd.w == 1.0;
    e.found = s > 0.5 && !closed;
    if (closed) e.visibility = 0.0;
  }
  bvec4 sides = discontinuitySides(d);
  vec4 from_side = vec4(p.fraction.x, 1.0 - p.fraction.x, 1.0 - p.fraction.y, p.fraction.y);
  e.value = 2.0;
  for (int k = 0; k < 4; ++k) {
    if (!sides[k] || from_side[k] >= e.value) continue;
    e.value = from_side[k];
    e.gradient = -vec2(SIDES[k]);
  }
  return e;
}

HardEdge hardEdge(Receiver r) {
  HardEdge e = HardEdge(0.0, false, 0.0, vec2(0.0));
  ShadowPoint p;
  if (rbsmReceiver(r, p, e.visibility)) return e;
  vec4 N;
  e.visibility = testNeighbourhood(p, N);
  vec3 d = packDiscontinuity(N, e.visibility);
  if (d.x > 0.0 || d.y > 0.0) e = edgeInTexel(p, e.visibility, d);
  return e;
}

// Gradient in camera view space of a function of the place in the map, given its gradient per texel.
vec3 viewGradient(vec3 position, vec2 gradient) {
  mat4 m = view.light_clip_from_view[0];
  LightPoint l = lightSpace(position, 0);
  vec2 scale = gradient * vec2(view.map_size) * (0.5 / l.w);
  return scale.x * (rowOf(m, 0) - l.ndc.x * rowOf(m, 3)) + scale.y * (rowOf(m, 1) - l.ndc.y * rowOf(m, 3));
}

void workOn(ivec2 pixel) {
  if ((seed_bits[pixel.x + view.size.x * (pixel.y / 32)] >> (pixel.y & 31) & 1u) == 0) return;
  Receiver r = receiverAt(pixel);
  Seed seed = Seed(seedPoint(pixel, seeds[seedIndex(pixel)]), r.normal, vec3(0.0));
  // On the way from the lit pixel to the middle of its neighbours in shadow.
  vec3 start = r.position, across = 2.0 * (seed.point - start);
  float lit = 0.0, dark = 1.0, at = 0.5;
  bool open = true;
  for (int i = 0; open && i < STEPS; ++i) {
    float middle = 0.5 * (lit + dark);
    r.position = start + middle * across;
    HardEdge e = hardEdge(r);
    if (e.found) {
      vec3 slope = viewGradient(r.position, e.gradient);
      float root = middle - e.value / dot(slope, across);
      if (root > lit && root < dark) {
        at = root;
        vec3 along = cross(r.normal, slope);
        float l = length(along);
        if (l > 0.0) seed.along = along / l;
        open = false;
      }
    }
    if (e.visibility > 0.5) lit = middle;
    else dark = middle;
  }
  // Around corners of the shadow the end of the way may be lit; then the point stays where it is.
  if (open && dark < 1.0) at = 0.5 * (lit + dark);
  seed.point = start + at * across;
  seeds[seedIndex(pixel)] = packSeed(pixel, seed);
}

void main() {
  uint threads = 64 * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < list.count; i += threads) workOn(unpackTile(list.pixels[i]));
}
