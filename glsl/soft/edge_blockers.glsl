// Blocker search for techniques that revectorize edges. Include after common/blockers.glsl and
// common/rbsm_receiver.glsl.
//
// Departures from the papers: the filter has a least width, because the place of an edge is not known to within about a
// texel. If no tap of the search finds a blocker, the texel's neighbours are tested, since an edge may reach over from
// there.
#ifndef EDGESHADE_EDGE_BLOCKERS
#define EDGESHADE_EDGE_BLOCKERS

// Least half-width of search and filter, texels: half of `least_width`, unless the light is so small that even a
// blocker at the near plane could not cast such a penumbra.
vec2 leastHalfTexels(SoftReceiver r, AreaLight a, float least_width) {
  precise vec2 least = min(vec2(0.5 * least_width), windowTexels(searchHalfWidth(a, r.z, a.near)));
  return least;
}

// Half-width of the filter, texels. The limit keeps rounding from widening it beyond the window that was searched and
// classified.
vec2 edgeHalfTexels(SoftReceiver r, AreaLight a, float z_blocker, vec2 least, vec2 search) {
  precise vec2 half_texels = min(max(windowTexels(filterHalfWidth(a, r.z, z_blocker)), least), windowTexels(search));
  return half_texels;
}

// Searches the point's texel and its four neighbours for blockers. If one of these differs from the texel, an edge runs
// through it. `wanted` is that of findBlockers.
Blockers neighbouringBlockers(ShadowPoint p, AreaLight a, bool mean_depth, bool wanted) {
  precise float sum = 0.0;
  int count = 0;
  vec4 N = vec4(1.0);
  float own = 1.0;
  [[dont_unroll]] for (int k = 0; k < int(wanted); ++k) own = testNeighbourhood(p, N);
  int texels = min(own, min(min(N.x, N.y), min(N.z, N.w))) == 0.0 ? 5 : 0;
  [[dont_unroll]] for (int k = 0; k < texels; ++k) {
    ivec2 texel = k < 4 ? p.texel + SIDES[k] : p.texel;
    bool blocks = shadowTest(p, texel) == 0.0;
    float stored = shadowMapDepth(shadow_map, testedTexel(texel), 0, ivec2(view.map_size));
    sum += blocks ? blockerValue(a, stored, mean_depth) : 0.0;
    count += int(blocks);
  }
  precise float mean = sum / float(max(count, 1));
  return Blockers(blockerDistance(a, mean, mean_depth), count);
}

#endif
