// Fixed-size penumbrae from the distance to the nearest shadow edge.
// Macedo, Apolinario, "Improved anti-aliasing for Euclidean distance transform shadow mapping" (2018), eq. 8-10.
// Binding-free: include it anywhere.
//
// Departures; the paper's forms are kept beside them:
// * Two points count as one surface by their positions and normals (onePatch), with a tolerance in pixels. This holds
//   at every scale, and cuts off no penumbra on surfaces seen at a grazing angle or on curved ones. A surface ends at a
//   crease. The paper compares depths alone (sameDepth), in a unit that it does not state; its penumbrae run on over
//   creases.
// * Eq. 9 gives a filter's width as a share of the viewport's height. Here it is in pixels, from the size of a pixel.
#ifndef EDGESHADE_PENUMBRA
#define EDGESHADE_PENUMBRA

// Eq. 8: intensity at a point with the hard visibility `hard` (0 or 1) at the distance `D` from the shadow edge, for a
// penumbra of full width `P`; both in world units.
float penumbraIntensity(float hard, float D, float P) {
  if (!(D <= 0.5 * P)) return hard;
  return clamp(0.5 + (hard > 0.5 ? D : -D) / P, 0.0, 1.0);
}

// Largest distance in pixels between a point whose eye depth is at least `nearest` and a point within `radius` of it. A
// pixel at eye depth z is pixel_size.x z + pixel_size.y wide; `off_axis` is the largest secant of the view rays. For
// points at the depths z and z' the tangents of their view angles differ by at most radius off_axis / z'.
float pixelReach(float radius, float nearest, vec2 pixel_size, float off_axis) {
  float width = pixel_size.x * (nearest - radius) + pixel_size.y;
  return width > 0.0 ? min(radius * off_axis / width, 65536.0) : 65536.0;
}

// Cosine of 30 degrees. A surface ends at a crease, where its normal turns by more than this from one pixel to the
// next.
const float CREASE_COSINE = 0.8660254;

// True if a lit face and one that turns away from the light may meet between two points `apart` with the unit normals
// `n` and `m`. No shadow ends at such a ridge. In a valley one face may cast a shadow onto the other.
bool isRidge(vec3 n, vec3 m, vec3 apart) { return dot(n, m) < CREASE_COSINE && dot(n - m, apart) < 0.0; }

// Tests whether a point at the offset `apart` lies on the plane through a point with the unit normal `n`: at most
// `tolerance` pixels off it per pixel of distance. The points are `pixels` apart in the image, where a pixel is `pixel`
// wide.
bool nearPlane(vec3 n, vec3 apart, float pixels, float pixel, float tolerance) {
  return abs(dot(n, apart)) <= tolerance * pixel * pixels;
}

// Cosine of 84 degrees: a curved surface is followed no farther round. Faces at right angles stay apart in spite of
// rounding.
const float FARTHEST_COSINE = 0.1;

// Share of the tolerance that a curved surface needs beyond the angle of a crease: its facets turn by a few degrees
// each.
const float CURVED = 0.43;

// Tests whether two successive turns of the normal, with the cosines `first` and `second`, belong to a curved surface
// and not to a crease: the smaller angle is at least a third of the larger.
bool turnsEvenly(float first, float second) { return 9.0 * (1.0 - max(first, second)) >= 1.0 - min(first, second); }

// Tests whether two points may lie on one smooth surface. They are `apart` in space and `pixels` apart in the image,
// where a pixel is `pixel` wide; their unit normals are `n` and `m`. The vector between two points of a plane, a
// cylinder, a sphere or any paraboloid is perpendicular to the sum of their normals. The tolerated deviation
// corresponds to a point `tolerance` pixels off the other's plane per pixel of distance.
bool onePatch(vec3 n, vec3 m, vec3 apart, float pixels, float pixel, float tolerance) {
  return dot(n, m) > FARTHEST_COSINE && abs(dot(n + m, apart)) <= 2.0 * tolerance * pixel * pixels;
}

// The paper's test: eye depths differ by at most `tolerance`, taken as a share of the nearer one.
bool sameDepth(float a, float b, float tolerance) { return abs(a - b) <= tolerance * min(abs(a), abs(b)); }

#endif
