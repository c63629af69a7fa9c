// Percentage-closer filtering of revectorized visibility, RPCF: [CG] Macedo, Apolinario, "Improved anti-aliasing for
// Euclidean distance transform shadow mapping", section 5. Averages the ramp of eq. 7, or another function, over w x w
// texel offsets. The paper averages [JCGT] listing 5.
//
// The shader defines RPCF_WIDTH, odd, 1 to 31, and WINDOW_MOST as RPCF_WIDTH. It then includes lib/rbsm_profile.glsl,
// lib/rbsm_star.glsl, lib/texel_window.glsl and this file, in this order. Before it calls rpcfMean it tests every texel
// of the kernel and of the ring around it, and stores the tests as lib/texel_window.glsl describes.
#ifndef EDGESHADE_RPCF
#define EDGESHADE_RPCF

// Mean visibility over the kernel around p.texel. `function` is 0 for the ramp of eq. 7, 1 for RBSM*, 2 for the edge
// profile with RUN_ONLY, 3 for listing 5 as printed.
float rpcfMean(ShadowPoint p, int function) {
  const int w = RPCF_WIDTH;
  ivec2 first = p.texel - w / 2;
  if (function != 2) followBeyond(p, first, ivec2(w));
  float sum = 0.0;
  int uniform_lit = 0;
  // Texels left for the second loop: a bit per column, and a bit for each row that has any.
  uint left_texels[w];
  uint left_rows = 0u;
  for (int j = 0; j < w; ++j) {
    uint tests = window_rows[j + 1], left, right, edges = edgeBits(j, ivec2(w), left, right);
    uniform_lit += bitCount(tests & ~edges);
    left_texels[j] = 0u;
    if (function == 2) left_texels[j] = edges;
    else {
      for (; edges != 0u; edges &= edges - 1u) {
        int i = findLSB(edges);
        vec3 d;
        vec4 t;
        if (!traverseInWindow(ivec2(i, j), ivec2(w), d, t)) {
          left_texels[j] |= 1u << i;
          continue;
        }
        vec4 nrd = normalizeFragmentDistanceToSE(fragmentDistance(t, p.fraction));
        sum += function == 3   ? filterSilhouette(d, nrd)
               : function == 0 ? computeRBSMStarRamp(d, nrd)
                               : computeRBSMStarVisibility(d, nrd);
      }
    }
    if (left_texels[j] != 0u) left_rows |= 1u << j;
  }
  // Only a few texels are left, and each is followed for itself. They have a loop of their own, because a loop nested
  // in the one above would run in all of its rounds.
  while (left_rows != 0u) {
    int j = findLSB(left_rows), i = findLSB(left_texels[j]);
    left_texels[j] &= left_texels[j] - 1u;
    if (left_texels[j] == 0u) left_rows &= left_rows - 1u;
    ShadowPoint q = p;
    q.texel = first + ivec2(i, j);
    float s = bitAt(window_rows[j + 1], i) ? 1.0 : 0.0;
    vec3 d = computeDiscontinuity(q, s);
    if (function == 0) sum += revectorizeRamp(q, d);
    else if (function == 1) sum += revectorizeStar(q, d);
    else if (function == 3) sum += revectorizeShadowEdge(q, d, false);
    else sum += revectorizeProfile(q, d, RUN_ONLY);
  }
  return clamp((float(uniform_lit) + sum) / float(w * w), 0.0, 1.0);
}

#endif
