// A silhouette edge as the light sees it: a segment in the plane of the shadow map, with its depth. Binding-free.
// All computations are relative to an end of the segment: far from the map's origin, a line equation loses digits.
#ifndef EDGESHADE_EDGE_SEGMENT
#define EDGESHADE_EDGE_SEGMENT

struct EdgeSegment {
  vec2 a, b;     // texels; the occluder lies where cross2(b - a, p - a) > 0
  float za, zb;  // the map's depth at the ends; affine along the segment
  uint flags;    // 0: no part of it lies in the map
  uint edge;     // index in the list of silhouettes
  vec2 c;        // third vertex of the occluder's adjacent triangle (texels), and its depth; if SEGMENT_FACE is set
  float zc;
};
const uint SEGMENT_VALID = 1, SEGMENT_BOUNDARY = 2, SEGMENT_CUT_A = 4, SEGMENT_CUT_B = 8, SEGMENT_FACE = 16;

float cross2(vec2 a, vec2 b) {
  precise float c = a.x * b.y - a.y * b.x;
  return c;
}

// Parameter of the segment's point closest to p: 0 at a, 1 at b.
float segmentFoot(EdgeSegment e, vec2 p) {
  vec2 d = e.b - e.a;
  precise float along = dot(p - e.a, d), all = dot(d, d);
  return all > 0.0 ? clamp(along / all, 0.0, 1.0) : 0.0;
}

// Squared distance of a point from the segment, texels^2. At an end it equals the distance from the vertex to the bit,
// so that edges which share the vertex tie.
float segmentDistance2(EdgeSegment e, vec2 p) {
  float t = segmentFoot(e, p);
  precise vec2 d = t <= 0.0 ? p - e.a : t >= 1.0 ? p - e.b : p - (e.a + t * (e.b - e.a));
  precise float d2 = d.x * d.x + d.y * d.y;
  return d2;
}

// Tests whether any part of the segment lies within a square whose sides are `reach` away from its center.
bool entersSquare(EdgeSegment e, vec2 center, float reach) {
  precise vec2 d = e.b - e.a, from = e.a - center, sum = from + (e.b - center);
  precise float line = from.x * d.y - from.y * d.x, most = reach * (abs(d.x) + abs(d.y));
  return all(lessThanEqual(abs(sum), abs(d) + 2.0 * reach)) && abs(line) <= most;
}

// Signed distance from the segment's line, texels, positive on the occluder's side.
float lineDistance(EdgeSegment e, vec2 p) {
  vec2 d = e.b - e.a;
  float l = length(d);
  return l > 0.0 ? cross2(d, p - e.a) / l : 0.0;
}

float segmentDepth(EdgeSegment e, float t) {
  precise float z = e.za + t * (e.zb - e.za);
  return z;
}

// Tests whether a point lies in the triangle beside the segment, seen from the light; `z` is then the triangle's depth
// there.
bool faceCovers(EdgeSegment e, vec2 p, out float z) {
  vec3 w = vec3(cross2(e.c - e.b, p - e.b), cross2(e.a - e.c, p - e.c), cross2(e.b - e.a, p - e.a));
  float area = w.x + w.y + w.z;
  z = dot(w, vec3(e.za, e.zb, e.zc)) / area;
  return (e.flags & SEGMENT_FACE) != 0 && all(greaterThanEqual(w, vec3(0.0))) && area > 0.0;
}

// Tests whether the walk from p to q crosses the segment; `t` is then the parameter along the walk. A vertex on the way
// counts for exactly one of the edges that share it.
bool crosses(EdgeSegment e, vec2 p, vec2 q, out float t) {
  vec2 d = e.b - e.a, walk = q - p;
  float from = cross2(d, p - e.a), to = cross2(d, q - e.a);
  float a = cross2(walk, e.a - p), b = cross2(walk, e.b - p);
  t = from / (from - to);
  return (from >= 0.0) != (to >= 0.0) && (a >= 0.0) != (b >= 0.0);
}

#endif
