#version 460
// Projects silhouette edges to segments in the shadow map's plane, like the map's own vertices. It clips them at the
// map and at the light before the division, so that no point behind the light is ever divided.
#extension GL_GOOGLE_include_directive : require
#include "casters.glsl"
#include "lib/edge_segment.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, scalar) readonly buffer Positions { float positions[]; };
layout(binding = 1, scalar) readonly buffer Lights { CasterLight lights[]; };
layout(binding = 2, scalar) readonly buffer Header { SilhouetteHeader header; };
layout(binding = 3, scalar) readonly buffer Silhouettes { SilhouetteEdge silhouettes[]; };
layout(binding = 4, scalar) writeonly buffer Segments { EdgeSegment segments[]; };

layout(binding = 5, scalar) readonly buffer Triangles { uvec3 triangles[]; };

layout(push_constant, scalar) uniform Push {
  vec2 map_size;  // texels
  float margin;   // texels around the map that segments may reach into
  float nearest;  // smallest w that is kept
  float mirrored; // -1 if the light's projection mirrors its image
  uint stride;    // floats from one vertex to the next
} push;

vec4 clipOf(uint v, mat4 m) {
  uint i = v * push.stride;
  precise vec4 q = m * vec4(positions[i], positions[i + 1], positions[i + 2], 1.0);
  return q;
}

// Clips the range of t along a..b to where a plane's value is not negative.
void cut(float a, float b, inout vec2 range) {
  if (a < 0.0) range.x = max(range.x, b > a ? a / (a - b) : 2.0);
  if (b < 0.0) range.y = min(range.y, a > b ? a / (a - b) : -1.0);
}

void endAt(vec4 q, out vec2 p, out float z) {
  precise vec3 ndc = q.xyz / q.w;
  precise vec2 texel = (0.5 * ndc.xy + 0.5) * push.map_size;
  p = texel;
  z = ndc.z;
}

void main() {
  uint i = 64 * chunkIndex(gl_WorkGroupID) + gl_LocalInvocationIndex;
  if (i >= header.count) return;
  SilhouetteEdge s = silhouettes[i];
  mat4 m = lights[s.instance].clip_from_object;
  // Seen from the light, the occluder lies to the left of a silhouette edge a -> b, and to the right of a segment.
  bool swapped = push.mirrored > 0.0;
  vec4 a = clipOf(swapped ? s.b : s.a, m), b = clipOf(swapped ? s.a : s.b, m);
  vec2 range = vec2(0.0, 1.0), reach = 1.0 + 2.0 * push.margin / push.map_size;
  cut(a.w - push.nearest, b.w - push.nearest, range);
  cut(reach.x * a.w + a.x, reach.x * b.w + b.x, range);
  cut(reach.x * a.w - a.x, reach.x * b.w - b.x, range);
  cut(reach.y * a.w + a.y, reach.y * b.w + b.y, range);
  cut(reach.y * a.w - a.y, reach.y * b.w - b.y, range);
  EdgeSegment e;
  e.edge = i;
  e.flags = 0;
  e.a = e.b = e.c = vec2(0.0);
  e.za = e.zb = e.zc = 0.0;
  bool kept = (s.flags & SILHOUETTE_OUTLINE) != 0 && range.x <= range.y;
  if (kept) {
    e.flags = SEGMENT_VALID | ((s.flags & SILHOUETTE_BOUNDARY) != 0 ? SEGMENT_BOUNDARY : 0) |
              (range.x > 0.0 ? SEGMENT_CUT_A : 0) | (range.y < 1.0 ? SEGMENT_CUT_B : 0);
    precise vec4 from = range.x > 0.0 ? a + range.x * (b - a) : a;
    precise vec4 to = range.y < 1.0 ? a + range.y * (b - a) : b;
    endAt(from, e.a, e.za);
    endAt(to, e.b, e.zb);
    // This also rejects the NaN of absurd vertices or transforms.
    if (!(dot(e.a, e.a) < 1e12 && dot(e.b, e.b) < 1e12)) e.flags = 0;
    uvec3 t = triangles[s.face];
    uint third = t.x != s.a && t.x != s.b ? t.x : t.y != s.a && t.y != s.b ? t.y : t.z;
    vec4 c = clipOf(third, m);
    if (e.flags != 0 && c.w > push.nearest) {
      endAt(c, e.c, e.zc);
      if (dot(e.c, e.c) < 1e12) e.flags |= SEGMENT_FACE;
    }
  }
  segments[i] = e;
}
