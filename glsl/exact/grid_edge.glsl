// A silhouette edge in the light's grid, and the cells that its wedge reaches: an edge matters to a receiver if the
// light, seen from there, contains part of it. Binding-free.
#ifndef EDGESHADE_GRID_EDGE
#define EDGESHADE_GRID_EDGE

struct GridEdge {
  vec3 a, b;  // ends: ndc and depth; the occluder lies where cross2(b - a, p - a) > 0
  int weight; // layers that end here
};

// Clips the range of t to where a + t (b - a) is not negative.
void cutRange(float a, float b, inout vec2 range) {
  if (a < 0.0) range.x = max(range.x, b > a ? a / (a - b) : 2.0);
  if (b < 0.0) range.y = min(range.y, a > b ? a / (a - b) : -1.0);
}

// Clips the range of t to where all components of a + t (b - a) are not negative. Returns false if nothing is left.
bool cutRange(vec4 a, vec4 b, inout vec2 range) {
  if (any(lessThan(max(a, b), vec4(0.0)))) return false;
  cutRange(a.x, b.x, range);
  cutRange(a.y, b.y, range);
  cutRange(a.z, b.z, range);
  cutRange(a.w, b.w, range);
  return range.x <= range.y;
}

// Tests whether the edge may matter to a receiver in a square whose receivers lie at most at `deepest`. `range` is the part
// of the edge that may.
bool mayReach(GridEdge e, vec2 center, float half_size, float deepest, vec2 kappa, out vec2 range) {
  range = vec2(0.0, 1.0);
  vec2 away_a = e.a.xy - center, away_b = e.b.xy - center;
  float above_a = deepest - e.a.z, above_b = deepest - e.b.z;
  cutRange(above_a, above_b, range);
  vec2 wide_a = half_size + kappa * above_a, wide_b = half_size + kappa * above_b;
  return cutRange(vec4(wide_a - away_a, wide_a + away_a), vec4(wide_b - away_b, wide_b + away_b), range);
}

// Finds bounds of the receivers that see a part of the edge on the light: they lie between `low` and `high` and not nearer to
// the light than `nearest`, if none lies deeper than `deepest`.
void reachOf(GridEdge e, vec2 range, float deepest, vec2 kappa, out vec2 low, out vec2 high, out float nearest) {
  vec3 from = mix(e.a, e.b, range.x), to = mix(e.a, e.b, range.y);
  vec2 wide_from = kappa * (deepest - from.z), wide_to = kappa * (deepest - to.z);
  // Rounding of places between the ends.
  vec3 rounding = 1e-6 * max(abs(e.a), abs(e.b));
  vec2 around = rounding.xy + kappa * rounding.z;
  low = min(from.xy - wide_from, to.xy - wide_to) - around;
  high = max(from.xy + wide_from, to.xy + wide_to) + around;
  nearest = min(from.z, to.z) - rounding.z;
}

#endif
