// Value of an edge in the edge distance map: Kenzel, "Edge Distance Shadow Mapping" (2013), section 3.2.3.
// Include after drawn_edge.glsl.
#ifndef EDGESHADE_EDSM_DISTANCE
#define EDGESHADE_EDSM_DISTANCE

struct EdgeDistance {
  float signed_distance; // from the edge's line, positive on the occluder's side; texels, or as printed in edge lengths
  float priority;        // 0 to 1; the smallest wins
  float along;           // position along the edge, 0 at a to 1 at b
};

// Distance and priority at a point, for a quad of a half width in texels.
// Eq. 3.3 divides by the squared length of the line's normal, which gives no distance and a different scale for every
// edge: `printed` keeps that, with the length of what is left of the edge in and near the map; otherwise the divisor is
// the length. In eq. 3.8, as printed, (p - p0) . e is the signed distance itself, so that both its cases are |d|. The
// text says that |d| alone fails. Priorities:
//   SEGMENT: the distance to the edge itself. If two edges end in the nearest corner and are equally near, the one whose
//            line is farther wins. If the point lies outside the shape, this edge has the point on its outer side.
//   COSINE:  |d| within the edge's span; beyond it the larger of |d| and the cosine at the corner; all in half widths.
//   PRINTED: |d|, in the units that are stored.
const int SEGMENT = 0, COSINE = 1, PRINTED_PRIORITY = 2;

EdgeDistance edgeDistance(EdgeSegment e, vec2 p, float half_width, bool printed, int priority) {
  precise vec2 d = e.b - e.a, away = p - e.a;
  precise float l = length(d), t = dot(away, d) / (l * l);
  EdgeDistance r;
  precise float signed_distance = (d.x * away.y - d.y * away.x) / l;
  // Half precision holds up to 65504.
  r.signed_distance = printed ? clamp(signed_distance / l, -6e4, 6e4) : signed_distance;
  r.along = clamp(t, 0.0, 1.0);
  precise vec2 from_corner = t <= 0.0 ? away : p - e.b;
  precise float to_corner = length(from_corner);
  bool beyond = t <= 0.0 || t >= 1.0;
  float off = abs(signed_distance);
  if (priority == PRINTED_PRIORITY) {
    // Ascending with |d|, below 1.
    float stored = abs(r.signed_distance);
    r.priority = stored / (1.0 + stored);
  } else if (priority == COSINE) {
    precise float corner = beyond && to_corner > 0.0 ? abs(dot(from_corner, d)) / (to_corner * l) : 0.0;
    // Less than the value that the depth target is cleared to.
    r.priority = 0.9999 * min(max(off / half_width, corner), 1.0);
  } else {
    precise float near = beyond ? to_corner : off;
    // The largest possible distance is a diagonal of the square at the corner.
    r.priority = clamp((near - 1e-4 * off) / (1.4143 * half_width), 0.0, 1.0);
  }
  return r;
}

#endif
