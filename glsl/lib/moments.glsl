// Moments of the depths in a window of the shadow map, and the bounds that they give for the lit share of the window:
// Donnelly, Lauritzen, "Variance shadow maps" (2006); Lauritzen, McCool, "Layered variance shadow maps" (2008), for the
// warp; Peters, Klein, "Moment shadow mapping" (2015); Peters, Muenstermann, Wetzstein, Klein, "Improved moment shadow
// maps for translucent occluders, soft shadows and single scattering" (2017), for signed depths and the basis in which
// four moments are stored. Binding-free: include it anywhere.
//
// Depths here are linear along the light's axis and signed: -1 at the near plane, 1 at the far plane. Device depths of a
// perspective light crowd near 1, where their variance cannot be resolved.
#ifndef EDGESHADE_MOMENTS
#define EDGESHADE_MOMENTS

// Signed linear depth of a stored depth. `range` is far / near - 1, or 0 for a parallel light. Depths outside the map's
// range are limited to it.
float signedDepth(float depth, float range) {
  precise float x = 2.0 * depth / (1.0 + range * (1.0 - depth)) - 1.0;
  return clamp(x, -1.0, 1.0);
}

// Chebyshev's inequality: the largest share of depths that may lie at `t` or farther.
float chebyshev(float mean, float square, float t, float least_variance) {
  precise float variance = max(square - mean * mean, least_variance);
  precise float d = t - mean;
  return d <= 0.0 ? 1.0 : variance / (variance + d * d);
}

// Bounds from above leave light behind occluders. Counts everything below `reduction` as shadow and stretches the rest.
float reduceLeaking(float v, float reduction) { return clamp((v - reduction) / (1.0 - reduction), 0.0, 1.0); }

// The two warps of exponential variance shadow maps. Both grow with the depth.
vec2 warpDepth(float x, vec2 exponents) { return vec2(exp(exponents.x * x), -exp(-exponents.y * x)); }

const float ROOT_3 = 1.7320508075688772;

// Four moments of a depth in a basis in which each lies in [0, 1] and 16 bits of each serve best. It is linear up to a
// constant, so it commutes with filters whose weights have the sum 1.
vec4 packedMoments(float x) {
  precise float x2 = x * x, x3 = x2 * x, x4 = x2 * x2;
  precise vec4 p = vec4(1.5 * x - 2.0 * x3 + 0.5, 4.0 * (x2 - x4), 0.5 * ROOT_3 * x - 2.0 / 9.0 * ROOT_3 * x3 + 0.5,
                        0.5 * (x2 + x4));
  return p;
}

// The means of x, x^2, x^3 and x^4.
vec4 unpackMoments(vec4 p) {
  precise float u = p.x - 0.5, v = p.z - 0.5;
  precise vec4 b = vec4(-1.0 / 3.0 * u + ROOT_3 * v, 0.125 * p.y + p.w, -0.75 * u + 0.75 * ROOT_3 * v, -0.125 * p.y + p.w);
  return b;
}

// Second and fourth of moments that lie well inside those of all distributions. The first suits floats, the second packed
// integers.
const float POSSIBLE = 0.375, POSSIBLE_PACKED = 0.628;

// Replaces a share of the moments, because rounding may have left none that are possible.
vec4 biasMoments(vec4 b, float possible, float share) { return mix(b, vec4(0.0, possible, 0.0, possible), share); }

// The distribution of three depths, `t` among them, that has the moments b.
struct ThreeDepths {
  vec2 z; // the other two
  vec2 w; // their weights
};

ThreeDepths threeDepths(vec4 b, float t) {
  precise float l = b.z - b.x * b.y, d = b.y - b.x * b.x, s = b.w - b.y * b.y;
  // Two depths make this 0. Single precision may make it less, and the largest part of it is certain to 22 bits.
  precise float q = max(s * d - l * l, s * d / 4194304.0);
  ThreeDepths r;
  // Too little is left of the moments: the two depths around the mean that a variance allows, one of them `t`.
  if (!(d > 0.0) || !(q > 0.0)) {
    float variance = max(d, 1e-7), away = b.x - t;
    float w = away * away / (variance + away * away);
    r.z = vec2(away == 0.0 ? 0.0 : b.x + variance / away, 0.0);
    r.w = vec2(w, 0.0);
    return r;
  }
  // c0 + c1 z + c2 z^2 has the other two depths as roots: Cholesky's method for the matrix of the moments.
  precise float k = l / d, c1 = t - b.x, c2 = t * t - b.y - k * c1;
  c1 /= d;
  c2 *= d / q;
  c1 -= k * c2;
  precise float c0 = 1.0 - c1 * b.x - c2 * b.y;
  float largest = max(max(abs(c0), abs(c1)), abs(c2));
  c0 /= largest;
  c1 /= largest;
  c2 /= largest;
  // Neither root may lose its digits in a difference: y / c2 is the larger one, c0 / y the other.
  precise float root = sqrt(max(c1 * c1 - 4.0 * c2 * c0, 0.0)), y = -0.5 * (c1 + (c1 < 0.0 ? -root : root));
  r.z = vec2(y == 0.0 ? 0.0 : c0 / y, c2 == 0.0 ? 2.0 : y / c2);
  // Lagrange's weights. Where `t` is itself a depth of a distribution of two, the larger root goes to infinity and its
  // weight to 0; its reciprocal i stays.
  precise float a = t - r.z.x, n = b.y - b.x * (t + r.z.x) + t * r.z.x;
  if (abs(y) > abs(c2)) {
    precise float i = c2 / y, to_t = 1.0 - t * i, apart = 1.0 - r.z.x * i;
    precise float m = t - b.x + (b.y - b.x * t) * i;
    r.w = vec2(a * apart == 0.0 ? 0.0 : m / (a * apart), to_t * apart == 0.0 ? 0.0 : n * i * i / (to_t * apart));
  } else {
    precise float to_t = r.z.y - t, apart = r.z.y - r.z.x;
    precise float m = b.y - b.x * (t + r.z.y) + t * r.z.y;
    r.w = vec2(a * apart == 0.0 ? 0.0 : m / (a * apart), to_t * apart == 0.0 ? 0.0 : n / (to_t * apart));
  }
  return r;
}

// Share of depths that certainly lie nearer than `t`: the least over all distributions with the moments b.
float hamburgerShadow(ThreeDepths r, float t) {
  float g = (r.z.x < t ? r.w.x : 0.0) + (r.z.y < t ? r.w.y : 0.0);
  // A share that is not positive proves no shadow.
  return g > 0.0 ? min(g, 1.0) : 0.0;
}

float hamburgerShadow(vec4 b, float t) { return hamburgerShadow(threeDepths(b, t), t); }

// The same over the distributions on [-1, 1], the range of the map. Where a depth of the three lies outside it, both
// ends of the range and one other depth take the places of the two.
float hausdorffShadow(vec4 b, float t) {
  ThreeDepths r = threeDepths(b, t);
  float g = hamburgerShadow(r, t);
  if (all(lessThanEqual(abs(r.z), vec2(1.0)))) return g;
  precise float above = b.w - b.y + t * (b.x - b.z), below = t * (1.0 - b.y) + b.z - b.x;
  if (abs(t) >= 1.0 || below == 0.0) return g;
  precise float z = above / below, apart = z - t;
  // The weights are divided by these products. Small ones leave nothing of the weights in single precision.
  float least = min((1.0 - z * z) * abs(apart), (1.0 + z) * (1.0 + t));
  if (!(abs(z) < 1.0) || least < 1e-4) return g;
  // Lagrange's weights of -1 and z among -1, z, t and 1.
  precise float at_near = (b.z - b.y * (z + t + 1.0) + b.x * (z * t + z + t) - z * t) / (2.0 * (1.0 + z) * (-1.0 - t));
  precise float at_z = (b.z - t * b.y - b.x + t) / ((z * z - 1.0) * apart);
  float bounded = at_near + (z < t ? at_z : 0.0);
  return bounded > g ? min(bounded, 1.0) : g;
}

#endif
