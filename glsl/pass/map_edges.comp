#version 460
// Silhouette edges into the shadow map's space: projected, cut to what lies before the light and around the map. Kenzel, "Edge
// Distance Shadow Mapping" (2013), chapter 3. One record an edge of the list, in its order.
// Departure: the edges are cut before they are projected, so that quads around them can be built after the projection and
// are as wide as asked for; the thesis widens them before it and loses width with the distance.
#extension GL_GOOGLE_include_directive : require
#include "casters.glsl"
#include "map_edge.glsl"
#include "silhouettes.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Positions { float positions[]; };
layout(binding = 1, scalar) readonly buffer Lights { CasterLight lights[]; };
layout(binding = 2, scalar) readonly buffer Header { SilhouetteHeader header; };
layout(binding = 3, scalar) readonly buffer Silhouettes { SilhouetteEdge silhouettes[]; };
layout(binding = 4, scalar) writeonly buffer MapEdges { MapEdge map_edges[]; };

layout(push_constant, scalar) uniform Push {
  uint stride;  // of a vertex, floats
  float margin; // around the map, texels
  uvec2 map_size;
} push;

vec4 projected(uint vertex, uint instance) {
  uint at = vertex * push.stride;
  precise vec4 p = lights[instance].clip_from_object * vec4(positions[at], positions[at + 1], positions[at + 2], 1.0);
  return p;
}

// How far a point lies within a border of the map, its margin included; w > 0 within all of them.
float within(vec4 p, int side, vec2 reach) {
  int axis = side & 1;
  precise float d = reach[axis] * p.w + (side < 2 ? p[axis] : -p[axis]);
  return d;
}

vec2 texelsOf(vec4 p, vec2 map_size) {
  precise vec2 t = (0.5 * (p.xy / p.w) + 0.5) * map_size;
  return t;
}

MapEdge mapEdge(SilhouetteEdge s) {
  vec2 map_size = vec2(push.map_size);
  vec4 a = projected(s.a, s.instance), b = projected(s.b, s.instance);
  vec2 reach = 1.0 + 2.0 * push.margin / map_size;
  precise float t0 = 0.0, t1 = 1.0;
  // Four sides, and in front of the light by enough to divide.
  float smallest = 1e-6 * (abs(a.w) + abs(b.w));
  for (int side = 0; side < 5; ++side) {
    precise float da = side < 4 ? within(a, side, reach) : a.w - smallest;
    precise float db = side < 4 ? within(b, side, reach) : b.w - smallest;
    if (da < 0.0 && db < 0.0) t1 = -1.0;
    else if (da < 0.0) t0 = max(t0, da / (da - db));
    else if (db < 0.0) t1 = min(t1, da / (da - db));
  }
  MapEdge e;
  e.flags = 0;
  if ((s.flags & SILHOUETTE_OUTLINE) == 0 || !(t0 < t1)) return e;
  precise vec4 first = t0 > 0.0 ? a + t0 * (b - a) : a, last = t1 < 1.0 ? a + t1 * (b - a) : b;
  e.a = texelsOf(first, map_size);
  e.b = texelsOf(last, map_size);
  e.za = first.z / first.w;
  e.zb = last.z / last.w;
  if (e.a == e.b) return e;
  e.flags = MAP_EDGE_SEEN | (t0 > 0.0 ? 0u : MAP_EDGE_A) | (t1 < 1.0 ? 0u : MAP_EDGE_B);
  return e;
}

void main() {
  uint i = 64 * chunkIndex() + gl_LocalInvocationIndex;
  if (i >= header.count) return;
  MapEdge e = mapEdge(silhouettes[i]);
  if (e.flags == 0) e = MapEdge(vec2(0.0), vec2(0.0), 0.0, 0.0, 0);
  map_edges[i] = e;
}
