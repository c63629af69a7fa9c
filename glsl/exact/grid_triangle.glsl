// A caster's triangle as the light sees it, in homogeneous coordinates, so that triangles which reach behind the light
// need no clipping (Olano, Greer, "Triangle scan conversion using 2D homogeneous coordinates", 1997). Binding-free.
#ifndef EDGESHADE_GRID_TRIANGLE
#define EDGESHADE_GRID_TRIANGLE

struct GridTriangle {
  vec3 lines[3]; // a side's line: dot(line, (ndc, 1)) >= 0 on one side
  vec3 plane;    // depth of its plane: dot(plane, (ndc, 1))
  uint inner;    // bit i: the triangle lies where line i is not negative
  vec2 range;    // least and greatest depth of its vertices in front of the light
  vec2 low, high; // corners of the square around it in the light's image
};

// Value of a line or plane at a place of the light's image. All shaders compute the same bits.
float valueAt(vec3 line, vec2 ndc) {
  precise float v = line.x * ndc.x + line.y * ndc.y + line.z;
  return v;
}

// Tests whether the triangle covers a place. A place on the common side of two triangles belongs to exactly one of
// them, since both hold the side's line with the same bits.
bool coversPlace(vec3 lines[3], uint inner, vec2 ndc) {
  uint side = uint(valueAt(lines[0], ndc) >= 0.0) | uint(valueAt(lines[1], ndc) >= 0.0) << 1 |
              uint(valueAt(lines[2], ndc) >= 0.0) << 2;
  return side == inner;
}

float planeDepth(vec3 plane, vec2 range, vec2 ndc) { return clamp(valueAt(plane, ndc), range.x, range.y); }

// Least depth of the triangle's plane over a square with half-width `half_size` around `center`.
float nearestOver(GridTriangle t, vec2 center, float half_size) {
  float nearest = valueAt(t.plane, center) - half_size * (abs(t.plane.x) + abs(t.plane.y));
  return clamp(nearest, t.range.x, t.range.y);
}

// Tests whether the triangle may cover a receiver in a square whose receivers lie at most at `deepest`. The square has
// half-width `half_size` around `center`.
bool mayCover(GridTriangle t, vec2 center, float half_size, float deepest) {
  for (int i = 0; i < 3; ++i) {
    float at = valueAt(t.lines[i], center), reach = half_size * (abs(t.lines[i].x) + abs(t.lines[i].y));
    bool positive = (t.inner >> i & 1u) != 0;
    if (positive ? at + reach < 0.0 : at - reach > 0.0) return false;
  }
  return nearestOver(t, center, half_size) <= deepest;
}

#endif
