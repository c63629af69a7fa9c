// Fixed-size penumbrae out of the distance to the nearest shadow edge.
// Macedo, Apolinario, "Improved anti-aliasing for Euclidean distance transform shadow mapping" (2018), eq. 8-10.
// Binding-free: include it anywhere.
//
// Departures, each with the paper's form beside it:
// * What lies on one surface is told by the positions and normals of both points (onePatch), in pixels, which holds at every
//   scale and cuts penumbrae neither on surfaces seen at a grazing angle nor on curved ones; a surface ends at a crease. The
//   paper compares depths alone (sameDepth), in a unit that it does not state: its penumbrae run on over creases.
// * Eq. 9 gives a filter's width as a share of the viewport's height; here in pixels, from the size of a pixel.
#ifndef EDGESHADE_PENUMBRA
#define EDGESHADE_PENUMBRA

// Eq. 8: the intensity at a point of hard visibility `hard` (0 or 1), `D` away from the edge of a penumbra of full width
// `P`; both in world units.
float penumbraIntensity(float hard, float D, float P) {
  if (!(D <= 0.5 * P)) return hard;
  return clamp(0.5 + (hard > 0.5 ? D : -D) / P, 0.0, 1.0);
}

// How many pixels away at most a point can be seen that lies within `radius` of one whose eye depth is at least `nearest`.
// A pixel at eye depth z is pixel_size.x z + pixel_size.y wide; `off_axis` is the largest secant of the view rays. With the
// two points at depths z and z' the tangents differ by at most radius off_axis / z'.
float pixelReach(float radius, float nearest, vec2 pixel_size, float off_axis) {
  float width = pixel_size.x * (nearest - radius) + pixel_size.y;
  return width > 0.0 ? min(radius * off_axis / width, 65536.0) : 65536.0;
}

// Cosine of 30 degrees: a surface ends at a crease, where its normal turns by more from one pixel to the next.
const float CREASE_COSINE = 0.8660254;

// True if a lit face and one that turns away from the light may meet between points `apart`, with unit normals `n` and `m`: no
// shadow ends at such a ridge. In a valley one face may throw a shadow onto the other.
bool isRidge(vec3 n, vec3 m, vec3 apart) { return dot(n, m) < CREASE_COSINE && dot(n - m, apart) < 0.0; }

// Whether a point `apart` away from one with unit normal `n`, `pixels` away in the image where a pixel is `pixel` wide, lies
// on the surface there: off its plane by at most `tolerance` pixels a pixel.
bool nearPlane(vec3 n, vec3 apart, float pixels, float pixel, float tolerance) {
  return abs(dot(n, apart)) <= tolerance * pixel * pixels;
}

// Cosine of 84 degrees: a surface is followed no farther round. Faces at right angles stay apart whatever rounding does.
const float FARTHEST_COSINE = 0.1;

// Beyond the angle of a crease, how much of the tolerance a curved surface needs: its facets turn by a few degrees each.
const float CURVED = 0.43;

// Whether a turn of the normal by angles of the cosines `first` and `second`, one after the other, is that of a curved surface
// and no crease: the smaller angle is at least a third of the larger.
bool turnsEvenly(float first, float second) { return 9.0 * (1.0 - max(first, second)) >= 1.0 - min(first, second); }

// Whether points `apart`, with unit normals `n` and `m`, may lie on one smooth surface; `pixels` apart in the image where a
// pixel is `pixel` wide. The way between points of a plane, a cylinder, a sphere or any paraboloid is at right angles to the
// sum of their normals. It may be off by as much as puts a point `tolerance` pixels a pixel off the plane of the other.
bool onePatch(vec3 n, vec3 m, vec3 apart, float pixels, float pixel, float tolerance) {
  return dot(n, m) > FARTHEST_COSINE && abs(dot(n + m, apart)) <= 2.0 * tolerance * pixel * pixels;
}

// The paper's test: eye depths differ by at most `tolerance`, here a share of the nearer one.
bool sameDepth(float a, float b, float tolerance) { return abs(a - b) <= tolerance * min(abs(a), abs(b)); }

#endif
