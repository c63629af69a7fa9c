// Fits a straight line to a piece of the boundary between lit and shadowed texels. lib/rbsm_profile.glsl includes this
// file after lib/rbsm.glsl.
#ifndef EDGESHADE_RBSM_LINE
#define EDGESHADE_RBSM_LINE

// A unit piece of the boundary: a texel inside, and the direction out of it.
struct Crack {
  ivec2 texel;
  ivec2 across;
};

struct FittedLine {
  ivec2 origin; // places are relative to the centre of this texel
  vec2 normal;  // unit length, from inside to outside
  float offset; // dot product of the normal with places on the line
};

const int FITTED_CRACKS = 8;    // number walked on either side of the first
const float LEAST_ACROSS = 0.3; // a line with a smaller component across a side has no useful height over it

// Moves on to the next crack. Returns false where four texels meet like a chess board, so that there are two ways on.
bool nextCrack(ShadowPoint p, float s, inout Crack crack, inout ivec2 along) {
  ivec2 ahead = crack.texel + along, beyond = ahead + crack.across;
  bool ahead_inside = shadowTest(p, ahead) == s, beyond_inside = shadowTest(p, beyond) == s;
  ivec2 across = crack.across;
  if (ahead_inside && beyond_inside) {
    crack = Crack(beyond, -along);
    along = across;
  } else if (ahead_inside) {
    crack.texel = ahead;
  } else if (!beyond_inside) {
    crack.across = along;
    along = -across;
  }
  return ahead_inside || !beyond_inside;
}

// Fits a least-squares line to the middles of the cracks around `first`, then moves it into the middle of the gap
// between the centres of inside and outside texels. Returns false if the boundary cannot be followed far enough, or if
// no line separates the centres.
bool fittedLine(ShadowPoint p, float s, Crack first, out FittedLine line) {
  line = FittedLine(first.texel, vec2(0.0), 0.0);
  Crack cracks[2 * FITTED_CRACKS + 1];
  cracks[0] = first;
  int count = 1;
  for (int side = -1; side <= 1; side += 2) {
    Crack crack = first;
    ivec2 along = side * abs(first.across.yx);
    for (int i = 0; i < FITTED_CRACKS; ++i) {
      if (!nextCrack(p, s, crack, along)) return false;
      cracks[count++] = crack;
    }
  }
  // Sums of halves are exact.
  vec2 sum = vec2(0.0), outwards = vec2(0.0);
  for (int i = 0; i < count; ++i) {
    sum += vec2(cracks[i].texel - line.origin) + 0.5 * vec2(cracks[i].across);
    outwards += vec2(cracks[i].across);
  }
  vec2 mean = sum / float(count);
  precise float difference = 0.0, twice_product = 0.0;
  for (int i = 0; i < count; ++i) {
    vec2 m = vec2(cracks[i].texel - line.origin) + 0.5 * vec2(cracks[i].across) - mean;
    difference += m.x * m.x - m.y * m.y;
    twice_product += 2.0 * m.x * m.y;
  }
  // Principal axis of the middles.
  float r = length(vec2(difference, twice_product));
  vec2 axis = difference >= 0.0 ? vec2(r + difference, twice_product) : vec2(twice_product, r - difference);
  axis = r > 0.0 ? normalize(axis) : vec2(1.0, 0.0);
  line.normal = vec2(-axis.y, axis.x);
  if (dot(line.normal, outwards) < 0.0) line.normal = -line.normal;
  float inside = -1e9, outside = 1e9;
  for (int i = 0; i < count; ++i) {
    vec2 at = vec2(cracks[i].texel - line.origin);
    inside = max(inside, dot(line.normal, at));
    outside = min(outside, dot(line.normal, at + vec2(cracks[i].across)));
  }
  line.offset = 0.5 * (inside + outside);
  return inside < outside;
}

// Height of the line over a crack, measured into the crack's texel, `distance` texels from the texel's centre in
// direction `along`. Returns false if the line is too steep there.
bool heightOver(FittedLine line, Crack crack, float distance, ivec2 along, out float height) {
  float across = dot(line.normal, vec2(crack.across));
  vec2 at = vec2(crack.texel - line.origin) + 0.5 * vec2(crack.across) + distance * vec2(along);
  height = (dot(line.normal, at) - line.offset) / across;
  return abs(across) > LEAST_ACROSS;
}

#endif
