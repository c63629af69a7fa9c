#version 460
// Projects the casters' silhouette edges and pairs each with the blocks of cells that its wedge may reach.
#extension GL_GOOGLE_include_directive : require
#include "caster_edges/casters.glsl"
#include "grid.glsl"
#include "grid_edge.glsl"
#include "caster_lists.glsl"

layout(local_size_x = 64) in;

layout(binding = 3, scalar) readonly buffer Positions { float positions[]; };
layout(binding = 4, scalar) readonly buffer Lights { CasterLight lights[]; };
layout(binding = 5, scalar) readonly buffer SilhouetteList { SilhouetteHeader silhouette_header; };
layout(binding = 6, scalar) readonly buffer Silhouettes { SilhouetteEdge silhouettes[]; };
layout(binding = 7, scalar) writeonly buffer GridEdges { GridEdge grid_edges[]; };

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

void main() {
  uint i = 64 * chunkIndex(gl_WorkGroupID) + gl_LocalInvocationIndex;
  if (i >= silhouette_header.count) return;
  SilhouetteEdge s = silhouettes[i];
  mat4 m = lights[s.instance].clip_from_object;
  // Seen from the light, the occluder lies to the left of a silhouette edge a -> b. The light's image has y downwards.
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
  e.weight = int(s.flags & SILHOUETTE_WEIGHT);
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
