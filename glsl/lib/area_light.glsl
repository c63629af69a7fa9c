// Similar triangles of an area light: how far a receiver must search for blockers, and how wide its penumbra is.
// Fernando, "Percentage-closer soft shadows" (2005); Macedo, Apolinario, Aguero (2019), eq. 6 and 7. Binding-free.
//
// The light is a square of full width w_l = 2 R parallel to the map, or a sun of full angle 2 theta. All distances z
// are linear: a spot's from the light along its axis, a sun's from the map's near plane. Along each axis of the map, T
// is the tangent of half the field of view and W the width of the sun's box:
//
//                                        spot                                sun
//   distance of a stored depth d         s / (o - d), s = n f/(f-n),         d o, o = f - n
//                                        o = f/(f-n)
//   filter half-width, uv                R/(2 T) (z - z_b)/(z z_b)           tan(theta)/W (z - z_b)
//   penumbra width, world                2 R (z - z_b)/z_b                   2 tan(theta) (z - z_b)
//
// The filter's half-width grows as the blocker distance z_b shrinks. If no blocker lies nearer to the light than
// z_nearest, the half-width at z_nearest therefore bounds the window to search for blockers. At the near plane this is
// the papers' window, the pyramid between receiver and light cut by the near plane; no filter is ever wider.
#ifndef EDGESHADE_AREA_LIGHT
#define EDGESHADE_AREA_LIGHT

struct AreaLight {
  vec2 uv;            // R/(2 T), or tan(theta)/W for a sun; along each axis of the map
  float world;        // R, or tan(theta) for a sun
  float depth_scale;  // s, or 0 for a sun
  float depth_offset; // o
  float near;         // distance of the near plane
};

// `factors` holds uv, world and depth offset, as the view's constants do.
AreaLight areaLight(vec4 factors, float depth_scale) {
  return AreaLight(factors.xy, factors.z, depth_scale, factors.w, depth_scale / factors.w);
}

// Linear distance of a stored depth. The limit keeps it finite at the far end, where single precision may leave nothing
// of o - d.
float lightDistance(AreaLight a, float depth) {
  precise float spot = a.depth_scale / max(a.depth_offset - depth, 1e-7), sun = depth * a.depth_offset;
  return a.depth_scale > 0.0 ? spot : sun;
}

// Half-width (uv) of the light as seen from a receiver at z, projected onto the map through a point at z_blocker; 0 for
// a blocker behind the receiver.
vec2 filterHalfWidth(AreaLight a, float z, float z_blocker) {
  float between = max(z - z_blocker, 0.0);
  float spot = 1.0 / max(z * z_blocker, 1e-30), inverse = a.depth_scale > 0.0 ? spot : 1.0;
  precise vec2 half_width = a.uv * (between * inverse);
  return between > 0.0 ? half_width : vec2(0.0);
}

// Half-width (uv) of the window that holds every blocker no nearer to the light than z_nearest.
vec2 searchHalfWidth(AreaLight a, float z, float z_nearest) { return filterHalfWidth(a, z, z_nearest); }

// Full width of the penumbra, world units, on a receiver parallel to the map.
float penumbraWidth(AreaLight a, float z, float z_blocker) {
  float between = max(z - z_blocker, 0.0);
  float spot = 1.0 / max(z_blocker, 1e-30), inverse = a.depth_scale > 0.0 ? spot : 1.0;
  precise float width = 2.0 * a.world * (between * inverse);
  return between > 0.0 ? width : 0.0;
}

#endif
