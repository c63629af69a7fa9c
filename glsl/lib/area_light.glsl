// Similar triangles of an area light: how far a receiver must search for blockers, and how wide its penumbra is.
// Fernando, "Percentage-closer soft shadows" (2005); Macedo, Apolinario, Aguero (2019), eq. 6 and 7. Binding-free.
//
// The light is a square of full width w_l = 2 R, parallel to the map, or a sun of full angle 2 theta. All distances z are
// linear: of a spot from the light along its axis, of a sun from the map's near plane. With T the tangent of half the map's
// field of view, or W the width of its box, by axis:
//
//                                        spot                                sun
//   distance of a stored depth d         s / (o - d), s = n f/(f-n),         d o, o = f - n
//                                        o = f/(f-n)
//   filter half-width, uv                R/(2 T) (z - z_b)/(z z_b)           tan(theta)/W (z - z_b)
//   penumbra width, world                2 R (z - z_b)/z_b                   2 tan(theta) (z - z_b)
//
// Nothing that blocks lies nearer to the light than some distance z_nearest, and the filter's half-width falls with z_b: so
// the half-width at z_nearest is where blockers are to be searched. With the near plane that is the papers' window, the
// pyramid between receiver and light cut by the near plane, and no filter is ever wider.
#ifndef EDGESHADE_AREA_LIGHT
#define EDGESHADE_AREA_LIGHT

struct AreaLight {
  vec2 uv;            // R/(2 T), or tan(theta)/W: by axis of the map
  float world;        // R, or tan(theta)
  float depth_scale;  // s, or 0 for a sun
  float depth_offset; // o
  float near;         // distance of the near plane
};

// `factors`: uv, world and depth offset, as the view's constants have them.
AreaLight areaLight(vec4 factors, float depth_scale) {
  return AreaLight(factors.xy, factors.z, depth_scale, factors.w, depth_scale / factors.w);
}

// Linear distance of a stored depth. Kept finite at the far end, where single precision may leave nothing of o - d.
float lightDistance(AreaLight a, float depth) {
  precise float z = a.depth_scale > 0.0 ? a.depth_scale / max(a.depth_offset - depth, 1e-7) : depth * a.depth_offset;
  return z;
}

// Half-width, uv, of what a light shows through a point at z_blocker on the map, seen from z; 0 behind the receiver.
vec2 filterHalfWidth(AreaLight a, float z, float z_blocker) {
  float between = max(z - z_blocker, 0.0);
  float inverse = a.depth_scale > 0.0 ? 1.0 / max(z * z_blocker, 1e-30) : 1.0;
  precise vec2 half_width = between > 0.0 ? a.uv * (between * inverse) : vec2(0.0);
  return half_width;
}

// Half-width, uv, of the window that holds every blocker that is no nearer to the light than z_nearest.
vec2 searchHalfWidth(AreaLight a, float z, float z_nearest) { return filterHalfWidth(a, z, z_nearest); }

// Full width of the penumbra, world units, on a receiver parallel to the map.
float penumbraWidth(AreaLight a, float z, float z_blocker) {
  float between = max(z - z_blocker, 0.0);
  float inverse = a.depth_scale > 0.0 ? 1.0 / max(z_blocker, 1e-30) : 1.0;
  precise float width = between > 0.0 ? 2.0 * a.world * (between * inverse) : 0.0;
  return width;
}

#endif
