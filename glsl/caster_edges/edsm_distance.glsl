// What an edge leaves in the edge distance map: Kenzel, "Edge Distance Shadow Mapping" (2013), section 3.2.3.
#ifndef EDGESHADE_EDSM_DISTANCE
#define EDGESHADE_EDSM_DISTANCE

struct EdgeDistance {
  float signed_distance; // of the edge's line, texels; positive on the occluder's side
  float priority;        // 0 to 1: the smallest stays
  float along;           // share of the way from a to b, kept to the edge
};

// At a point, for a quad of a half width in texels. Corrected: eq. 3.3 divides by the squared length of the line's normal,
// which is no distance and gives every edge a scale of its own. Eq. 3.8, as printed, is the plain distance that the text says
// fails; read as
//   COSINE: within the span |d|, beyond it the larger of |d| and the cosine at the corner, all in half widths;
//   else:   the distance to the edge itself, and of two edges that are equally near, both ending in the corner that is
//           nearest, the one whose line is farther: where a point is outside of both, that one says so.
EdgeDistance edgeDistance(EdgeSegment e, vec2 p, float half_width, bool cosine) {
  precise vec2 d = e.b - e.a, away = p - e.a;
  precise float l = length(d), t = dot(away, d) / (l * l);
  EdgeDistance r;
  precise float signed_distance = (d.x * away.y - d.y * away.x) / l;
  r.signed_distance = signed_distance;
  r.along = clamp(t, 0.0, 1.0);
  precise vec2 from_corner = t <= 0.0 ? away : p - e.b;
  precise float to_corner = length(from_corner);
  bool beyond = t <= 0.0 || t >= 1.0;
  float off = abs(signed_distance);
  if (cosine) {
    precise float corner = beyond && to_corner > 0.0 ? abs(dot(from_corner, d)) / (to_corner * l) : 0.0;
    // Below what the depth target is cleared to.
    r.priority = 0.9999 * min(max(off / half_width, corner), 1.0);
  } else {
    precise float near = beyond ? to_corner : off;
    // A diagonal of the square at the corner is the farthest there is.
    r.priority = clamp((near - 1e-4 * off) / (1.4143 * half_width), 0.0, 1.0);
  }
  return r;
}

#endif
