// Percentage-closer filtering of revectorized visibility, RPCF: [CG] Macedo, Apolinario, "Improved anti-aliasing for
// Euclidean distance transform shadow mapping", section 5. Averages the ramp of eq. 7, or another function, over w x w
// texel offsets. The paper averages [JCGT] listing 5.
//
// The shader defines RPCF_WIDTH, odd, 1 to 31, and WINDOW_MOST as RPCF_WIDTH. It then includes lib/rbsm_profile.glsl,
// lib/rbsm_star.glsl, lib/texel_window.glsl and this file, in this order. Before it calls rpcfMean it tests every texel
// of the kernel and of the ring around it, and stores the tests by clearWindow and setWindowRow.
#ifndef EDGESHADE_RPCF
#define EDGESHADE_RPCF

float kernelVisibility(int function, vec3 d, vec4 t, vec2 fraction) {
  vec4 nrd = normalizeFragmentDistanceToSE(fragmentDistance(t, fraction));
  return function == 3   ? filterSilhouette(d, nrd)
         : function == 0 ? computeRBSMStarRamp(d, nrd)
                         : computeRBSMStarVisibility(d, nrd);
}

// Mean visibility over the kernel around p.texel. `function` is 0 for the ramp of eq. 7, 1 for RBSM*, 2 for the edge
// profile with RUN_ONLY, 3 for listing 5 as printed.
float rpcfMean(ShadowPoint p, int function) {
  const int w = RPCF_WIDTH;
  ivec2 first = p.texel - w / 2;
  if (function != 2) followBeyond(p, first, ivec2(w));
  float sum = 0.0;
  int uniform_lit = 0;
  // Rows with texels that are left for the second loop.
  uint left_rows = 0u;
  [[dont_unroll]] for (int j = 0; j < w; ++j) {
    TexelLine row = windowRow(j);
    uint edges = edgeBits(row, j, ivec2(w));
    uniform_lit += bitCount(row.tests & ~edges);
    bool any_left = function == 2 && edges != 0u;
    [[dont_unroll]] for (uint open = function == 2 ? 0u : edges; open != 0u; open &= open - 1u) {
      vec3 d;
      vec4 t;
      if (traverseInWindow(row, ivec2(findLSB(open), j), ivec2(w), d, t) == 0u) {
        sum += kernelVisibility(function, d, t, p.fraction);
      } else {
        any_left = true;
      }
    }
    if (any_left) left_rows |= 1u << j;
  }
  // Texels with runs of their own have a loop of their own, because a loop nested in the one above would run in all of
  // its rounds.
  uint done = 0u; // columns of the row
  [[dont_unroll]] while (left_rows != 0u) {
    int j = findLSB(left_rows), i = -1;
    TexelLine row = windowRow(j);
    uint open = edgeBits(row, j, ivec2(w)) & ~done, own = 0u;
    vec3 d;
    vec4 t;
    [[dont_unroll]] while (i < 0 && open != 0u) {
      int next = findLSB(open);
      open &= open - 1u;
      if (function != 2) own = traverseInWindow(row, ivec2(next, j), ivec2(w), d, t);
      if (function == 2 || own != 0u) i = next;
    }
    done = open == 0u ? 0u : ~open;
    if (open == 0u) left_rows &= left_rows - 1u;
    if (i < 0) continue;
    if (function == 2) {
      ShadowPoint q = p;
      q.texel = first + ivec2(i, j);
      sum += revectorizeProfile(q, computeDiscontinuity(q, bitAt(row.tests, i) ? 1.0 : 0.0), RUN_ONLY);
    } else {
      followOwn(p, first, ivec2(w), ivec2(i, j), d, own, t);
      sum += kernelVisibility(function, d, t, p.fraction);
    }
  }
  return clamp((float(uniform_lit) + sum) / float(w * w), 0.0, 1.0);
}

#endif
