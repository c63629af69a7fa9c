// The blocker search where edges are revectorized. Departures from the papers: the filter is never narrower than a least width,
// since within about a texel it is not known where the edge is; where no tap of the search found a blocker, the texel's
// neighbours are asked, for an edge may reach over from there.
#ifndef EDGESHADE_EDGE_BLOCKERS
#define EDGESHADE_EDGE_BLOCKERS

// Half-width, texels, that search and filter have at least: that of `least_width` texels, unless the light is so small that not
// even what touches it could cast such a penumbra.
vec2 leastHalfTexels(SoftReceiver r, AreaLight a, float least_width) {
  precise vec2 least = min(vec2(0.5 * least_width), windowTexels(searchHalfWidth(a, r.z, a.near)));
  return least;
}

// Half-width of the filter, texels. Rounding must not carry it out of what was searched and classified.
vec2 edgeHalfTexels(SoftReceiver r, AreaLight a, float z_blocker, vec2 least, vec2 search) {
  precise vec2 half_texels = min(max(windowTexels(filterHalfWidth(a, r.z, z_blocker)), least), windowTexels(search));
  return half_texels;
}

// Blockers among the texel of the point and its four neighbours: where one of them differs, an edge runs through the texel.
Blockers neighbouringBlockers(ShadowPoint p, AreaLight a) {
  precise float sum = 0.0;
  int count = 0;
  for (int k = 0; k < 5; ++k) {
    ivec2 texel = k < 4 ? p.texel + SIDES[k] : p.texel;
    bool blocks = shadowTest(p, texel) == 0.0;
    sum += blocks ? lightDistance(a, shadowMapDepth(shadow_map, testedTexel(texel), 0, ivec2(view.map_size))) : 0.0;
    count += int(blocks);
  }
  precise float z = sum / float(max(count, 1));
  return Blockers(z, count);
}

#endif
