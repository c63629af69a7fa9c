// The shadow test, [JCGT] eq. 1: 1 is lit, 0 is in shadow; and the bounds of the rounding errors that its bias covers. Binding-free: functions take the sampler as an argument.
#ifndef EDGESHADE_SHADOW_TEST
#define EDGESHADE_SHADOW_TEST

// These bounds cover what single precision loses. They do not depend on the scene's scale.

// Relative error of a view-space position reconstructed from a D32 depth and carried through two f32 matrices.
const float POSITION_ULPS = 4.0 / 8388608.0;
// Absolute error of a depth in [0, 1]: the map's own rasterisation and the receiver's transform.
const float DEPTH_ULPS = 4.0 / 8388608.0;

// Depth of a texel by index. Texels outside the map are farther than everything; no index wraps or leaves the image.
float shadowMapDepth(sampler2DArray shadow_map, ivec2 texel, int layer, ivec2 map_size) {
  bool inside = all(greaterThanEqual(texel, ivec2(0))) && all(lessThan(texel, map_size));
  return inside ? texelFetch(shadow_map, ivec3(texel, layer), 0).x : 1.0;
}

// Returns the nearest texel of the map. Filters whose windows may be wider than the map read its border texels this
// way. They take both depth and place of that texel, so that a tilted receiver does not shadow itself.
ivec2 nearestTexel(ivec2 texel, ivec2 map_size) { return clamp(texel, ivec2(0), map_size - 1); }

// Returns 0 if the reference lies behind the stored depth. The reference is limited to the map's range, so that an
// empty texel never shadows, however far a receiver plane was extrapolated.
float shadowTest(float reference, float stored) { return min(reference, 1.0) > stored ? 0.0 : 1.0; }

#endif
