// The area that a filter of constant world width covers in the image: a parallelogram. Two passes along its sides
// filter it exactly. Binding-free: include it anywhere.
//
// There are three footprints for penumbrae that are filtered in screen space:
// * footprintScreen: Macedo, Apolinario, Aguero (2019), eq. 9. It treats the receiver as if it faced the camera. On
//   tilted receivers the penumbra then changes with the view.
// * footprintPlane: a square in the receiver's own plane (a circle for a Gaussian), which does not change with the
//   view. This is the aim of Zheng, Saito, "Screen space anisotropic blurred soft shadows" (2011). They use the axes of
//   an ellipse, whose direction is undefined where a receiver faces the camera. Here the first side runs along the
//   image's rows, and the second is perpendicular to it in the plane.
// * footprintLight: the light's square, projected through a point onto the receiver's plane. This is the area that a
//   filter in the shadow map covers: it is stretched by one over the cosine of the light's angle.
#ifndef EDGESHADE_FOOTPRINT
#define EDGESHADE_FOOTPRINT

// Half sides of a parallelogram, pixels.
struct Footprint {
  vec2 a;
  vec2 b;
};

// Change of a pixel's surface point from pixel to pixel.
struct PixelSteps {
  vec3 x;   // one pixel to the right, at the same eye depth; world units
  vec3 y;   // one pixel down
  vec3 ray; // direction in which the pixel looks, any length
};

// Cosines of view or light angles are clamped to at least this, so that grazing planes keep finite footprints.
const float GRAZING = 0.05;

Footprint footprintScreen(PixelSteps s, float half_width) {
  precise Footprint f;
  f.a = vec2(half_width / length(s.x), 0.0);
  f.b = vec2(0.0, half_width / length(s.y));
  return f;
}

// `n` is the plane's unit normal, on the viewer's side.
Footprint footprintPlane(PixelSteps s, vec3 n, float half_width) {
  precise float facing = min(dot(n, s.ray), -GRAZING * length(s.ray));
  precise vec3 x = s.x - s.ray * (dot(n, s.x) / facing), y = s.y - s.ray * (dot(n, s.y) / facing);
  precise float xx = dot(x, x), area = length(cross(x, y));
  precise Footprint f;
  f.a = vec2(half_width * inversesqrt(xx), 0.0);
  f.b = half_width * sqrt(xx) / area * vec2(-dot(x, y) / xx, 1.0);
  return f;
}

// Offset in pixels of a point that lies `d` away, to first order.
vec2 pixelsOf(PixelSteps s, vec3 d) {
  precise vec3 y_ray = cross(s.y, s.ray), ray_x = cross(s.ray, s.x);
  precise vec2 pixels = vec2(dot(d, y_ray), dot(d, ray_x)) / dot(s.x, y_ray);
  return pixels;
}

// `towards` is the unit vector to the light; `x` and `y` are unit vectors along the sides of the light's square.
Footprint footprintLight(PixelSteps s, vec3 n, vec3 towards, vec3 x, vec3 y, float half_width) {
  precise float facing = max(dot(n, towards), GRAZING);
  precise vec3 on_plane_x = half_width * (x - towards * (dot(n, x) / facing));
  precise vec3 on_plane_y = half_width * (y - towards * (dot(n, y) / facing));
  return Footprint(pixelsOf(s, on_plane_x), pixelsOf(s, on_plane_y));
}

#endif
