#version 460
// Projects the casters' silhouette edges, as the light's centre sees them, and pairs each with the blocks of cells that
// its wedge may reach.
//
// A receiver on the same side of a face's plane as the light's centre sees the face turned the other way. With FACES,
// the three sides of each face whose plane cuts the light are recorded too, with the change of weight that this makes.
#extension GL_GOOGLE_include_directive : require
#include "caster_edges/casters.glsl"
#include "grid.glsl"
#include "grid_edge.glsl"
#include "caster_lists.glsl"

layout(constant_id = 0) const bool FACES = false;

layout(local_size_x = 64) in;

layout(binding = 3, scalar) readonly buffer Positions { float positions[]; };
layout(binding = 4, scalar) readonly buffer Lights { CasterLight lights[]; };
layout(binding = 5, scalar) readonly buffer SilhouetteList { SilhouetteHeader silhouette_header; };
layout(binding = 6, scalar) readonly buffer Silhouettes { SilhouetteEdge silhouettes[]; };
layout(binding = 7, scalar) writeonly buffer GridEdges { GridEdge grid_edges[]; };
layout(binding = 8, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(binding = 9, scalar) readonly buffer Chunks { uint chunks[]; };
layout(binding = 10, scalar) readonly buffer Instances { CasterInstance instances[]; };
layout(binding = 11, scalar) readonly buffer Facing { uint facing[]; };
layout(binding = 12, scalar) readonly buffer FaceList {
  uint groups[3];
  uint count;
  uint bits[];
} faces;

// Distance from the middle of the light's image at which edges are clipped, ndc. Close to a spot its own half-width is
// wider than the image.
float farthest() {
  float wide = max(push.kappa.x, push.kappa.y) / max(push.nearest, 1e-30);
  return push.spot != 0 ? 5.0 + wide : 5.0;
}

vec4 clipOf(uint v, mat4 m) {
  uint i = v * push.stride;
  precise vec4 q = m * vec4(positions[i], positions[i + 1], positions[i + 2], 1.0);
  return q;
}

vec3 endAt(vec4 q) {
  precise float of_spot = -1.0 / q.w;
  precise vec3 end = vec3(q.xy / q.w, push.spot != 0 ? of_spot : q.z);
  return end;
}

// An edge with the occluder on its left as the light sees it.
struct Side {
  uint a, b;
  uint instance;
  uint weight;
};

// A side of a listed face, turned the other way.
Side sideOfFace(uint i) {
  uint bit = faces.bits[i / 3], k = i % 3;
  Side s;
  s.instance = chunks[bit / CHUNK];
  CasterInstance info = instances[s.instance];
  uvec3 v = triangles[info.first_triangle + bit - CHUNK * info.first_triangle_chunk];
  bool front = (facing[bit >> 5] >> (bit & 31u) & 1u) != 0;
  uint from = v[k], to = v[(k + 1) % 3];
  s.a = front ? to : from;
  s.b = front ? from : to;
  s.weight = lights[s.instance].shell != 0 ? 1 : 2;
  return s;
}

void main() {
  uint i = 64 * chunkIndex(gl_WorkGroupID) + gl_LocalInvocationIndex;
  Side s;
  if (FACES) {
    if (i == 0 && faces.count > push.faces) loseAll(faces.count - push.faces);
    if (i >= 3 * min(faces.count, push.faces)) return;
    s = sideOfFace(i);
    i += push.silhouettes;
  } else {
    if (i >= silhouette_header.count) return;
    SilhouetteEdge e = silhouettes[i];
    s = Side(e.a, e.b, e.instance, e.flags & SILHOUETTE_WEIGHT);
  }
  mat4 m = lights[s.instance].clip_from_object;
  // The light's image has y downwards.
  bool swapped = push.mirrored > 0.0;
  vec4 a = clipOf(swapped ? s.b : s.a, m), b = clipOf(swapped ? s.a : s.b, m);
  vec2 range = vec2(0.0, 1.0);
  cutRange(a.w - push.nearest, b.w - push.nearest, range);
  float most_away = farthest();
  cutRange(most_away * a.w + a.x, most_away * b.w + b.x, range);
  cutRange(most_away * a.w - a.x, most_away * b.w - b.x, range);
  cutRange(most_away * a.w + a.y, most_away * b.w + b.y, range);
  cutRange(most_away * a.w - a.y, most_away * b.w - b.y, range);
  if (!(range.x < range.y)) return;
  precise vec4 from = range.x > 0.0 ? a + range.x * (b - a) : a;
  precise vec4 to = range.y < 1.0 ? a + range.y * (b - a) : b;
  GridEdge e;
  e.a = endAt(from);
  e.b = endAt(to);
  e.weight = int(s.weight);
  // This also rejects numbers that are not finite.
  if (!(dot(e.a.xy, e.a.xy) < 1e12 && dot(e.b.xy, e.b.xy) < 1e12) || e.weight == 0) return;
  grid_edges[i] = e;
  uint greatest = depths[greatestDepth()];
  if (greatest == 0) return;
  float nearest = min(e.a.z, e.b.z);
  vec2 reach = push.kappa * max(orderedFloat(greatest) - nearest, 0.0);
  vec2 low = min(e.a.xy, e.b.xy) - reach, high = max(e.a.xy, e.b.xy) + reach;
  // A hundredth of a cell covers the rounding of places.
  vec2 most = vec2(float(push.cells));
  vec2 first = floor((0.5 * low + 0.5) * most - 0.01), last = floor((0.5 * high + 0.5) * most + 0.01);
  appendBlocks(i, ivec2(clamp(first, vec2(-1.0), most)), ivec2(clamp(last, vec2(-1.0), most)), nearest);
}
