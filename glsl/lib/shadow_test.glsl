// The shadow test: [JCGT] eq. 1, with 1 lit and 0 in shadow.
// Binding-free but for the sampler that is handed in.
#ifndef EDGESHADE_SHADOW_TEST
#define EDGESHADE_SHADOW_TEST

// Depth of a texel by index; outside the map farther than everything. Indices never wrap or run out of the image.
float shadowMapDepth(sampler2DArray shadow_map, ivec2 texel, int layer, ivec2 map_size) {
  bool inside = all(greaterThanEqual(texel, ivec2(0))) && all(lessThan(texel, map_size));
  return inside ? texelFetch(shadow_map, ivec3(texel, layer), 0).x : 1.0;
}

// The texel of the map that lies nearest: filters whose windows may be wider than the map go on with its border there. Depth
// and place are both that texel's, so that a tilted receiver does not shadow itself.
ivec2 nearestTexel(ivec2 texel, ivec2 map_size) { return clamp(texel, ivec2(0), map_size - 1); }

// 0 where the reference lies behind the stored depth. The reference is kept within the map's range, so that an
// empty texel never shadows, however far a receiver plane was extrapolated.
float shadowTest(float reference, float stored) { return min(reference, 1.0) > stored ? 0.0 : 1.0; }

#endif
