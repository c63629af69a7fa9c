// Percentage-closer filtering of revectorized visibility, RPCF: [CG] Macedo, Apolinario, "Improved anti-aliasing for
// Euclidean distance transform shadow mapping", section 5. Averages the ramp of eq. 7, or another function, over w x w
// texel offsets. The paper averages [JCGT] listing 5.
//
// The shader defines RPCF_WIDTH, odd, 1 to 31; RPCF_PIXELS, the number of pixels that it filters at once; and WINDOW_MOST,
// RPCF_WIDTH or more. It then includes lib/rbsm_profile.glsl, lib/rbsm_star.glsl, lib/texel_window.glsl and this file, in
// this order. For one pixel it stores the tests of the kernel and of the ring around it by clearWindow and setWindowRow, and
// calls rpcfMean. Pixels whose tests agree can be filtered together: the shader stores the tests of a window that holds all
// their kernels, sets rpcf_kernel and rpcf_fraction, and calls rpcfSum.
#ifndef EDGESHADE_RPCF
#define EDGESHADE_RPCF

// By pixel: the first texel of the kernel, counted from the window's, v in the upper half; the fragment's place in its texel;
// and the sum of the samples in units of 1/RPCF_ONE. Integers, so that the order of the samples changes no bit.
uint rpcf_kernel[RPCF_PIXELS];
vec2 rpcf_fraction[RPCF_PIXELS];
int rpcf_sum[RPCF_PIXELS];
const int RPCF_ONE = 1 << 21; // 31 x 31 samples fit

float kernelVisibility(int function, vec3 d, vec4 t, vec2 fraction) {
  vec4 nrd = normalizeFragmentDistanceToSE(fragmentDistance(t, fraction));
  return function == 3   ? filterSilhouette(d, nrd)
         : function == 0 ? computeRBSMStarRamp(d, nrd)
                         : computeRBSMStarVisibility(d, nrd);
}

int rpcfUnits(float visibility) {
  precise float units = visibility * float(RPCF_ONE) + 0.5;
  return int(units);
}

bool isInKernel(int pixel, ivec2 texel) {
  ivec2 kernel = ivec2(rpcf_kernel[pixel] & 0xffffu, rpcf_kernel[pixel] >> 16);
  return all(lessThan(uvec2(texel - kernel), uvec2(RPCF_WIDTH)));
}

// Replaces the test `s` of a texel at an edge by its visibility, in the sums of the pixels with the texel in their kernels.
void addRevectorized(int function, ivec2 texel, vec3 d, vec4 t) {
  int s = d.z > 0.0 ? 0 : RPCF_ONE;
  [[unroll]] for (int i = 0; i < RPCF_PIXELS; ++i) {
    int v = rpcfUnits(kernelVisibility(function, d, t, rpcf_fraction[i]));
    rpcf_sum[i] += isInKernel(i, texel) ? v - s : 0;
  }
}

// Sums the visibility over the kernels of all pixels; their window of `size` texels starts at `first`. `function` is 0 for the
// ramp of eq. 7, 1 for RBSM*, 3 for listing 5 as printed; with one pixel also 2, the edge profile with RUN_ONLY.
void rpcfSum(ShadowPoint p, ivec2 first, ivec2 size, int function) {
  if (function != 2) followBeyond(p, first, size);
  // Rows with texels at an edge, and those of them with texels that are left for the second loop.
  uint open_rows = 0u, left_rows = 0u;
  [[unroll]] for (int i = 0; i < RPCF_PIXELS; ++i) rpcf_sum[i] = 0;
  [[dont_unroll]] for (int j = 0; j < size.y; ++j) {
    TexelLine row = windowRow(j);
    [[unroll]] for (int i = 0; i < RPCF_PIXELS; ++i) {
      uint tests = row.tests >> (rpcf_kernel[i] & 0xffffu) & lineBits(RPCF_WIDTH);
      if (j - int(rpcf_kernel[i] >> 16) < 0 || j - int(rpcf_kernel[i] >> 16) >= RPCF_WIDTH) tests = 0u;
      rpcf_sum[i] += bitCount(tests) * RPCF_ONE;
    }
    if (edgeBits(row, j, size) != 0u) open_rows |= 1u << j;
  }
  uint done = 0u; // columns of the row
  if (function == 2) left_rows = open_rows;
  // One loop for the texels of all rows: threads with few of them in a row need not wait for the others.
  [[dont_unroll]] while (function != 2 && open_rows != 0u) {
    int j = findLSB(open_rows);
    TexelLine row = windowRow(j);
    uint open = edgeBits(row, j, size) & ~done;
    ivec2 texel = ivec2(findLSB(open), j);
    open &= open - 1u;
    done = open == 0u ? 0u : ~open;
    if (open == 0u) open_rows &= open_rows - 1u;
    vec3 d;
    vec4 t;
    if (traverseInWindow(row, texel, size, d, t) == 0u) addRevectorized(function, texel, d, t);
    else left_rows |= 1u << j;
  }
  // Texels with runs of their own have a loop of their own, because a loop nested in the one above would run in all of
  // its rounds.
  [[dont_unroll]] while (left_rows != 0u) {
    ivec2 texel = ivec2(-1, findLSB(left_rows));
    TexelLine row = windowRow(texel.y);
    uint open = edgeBits(row, texel.y, size) & ~done, own = 0u;
    vec3 d;
    vec4 t;
    [[dont_unroll]] while (texel.x < 0 && open != 0u) {
      int next = findLSB(open);
      open &= open - 1u;
      if (function != 2) own = traverseInWindow(row, ivec2(next, texel.y), size, d, t);
      if (function == 2 || own != 0u) texel.x = next;
    }
    done = open == 0u ? 0u : ~open;
    if (open == 0u) left_rows &= left_rows - 1u;
    if (texel.x < 0) continue;
    if (function == 2) {
      ShadowPoint q = p;
      q.texel = first + texel;
      float s = bitAt(row.tests, texel.x) ? 1.0 : 0.0;
      rpcf_sum[0] += rpcfUnits(revectorizeProfile(q, computeDiscontinuity(q, s), RUN_ONLY)) - rpcfUnits(s);
    } else {
      followOwn(p, first, size, texel, d, own, t);
      addRevectorized(function, texel, d, t);
    }
  }
}

// Mean visibility over the kernel of pixel i.
float rpcfMeanOf(int i) {
  precise float mean = float(rpcf_sum[i]) / (float(RPCF_ONE) * float(RPCF_WIDTH * RPCF_WIDTH));
  return mean;
}

// Mean visibility over the kernel around p.texel, whose tests the window holds.
float rpcfMean(ShadowPoint p, int function) {
  rpcf_kernel[0] = 0u;
  rpcf_fraction[0] = p.fraction;
  rpcfSum(p, p.texel - RPCF_WIDTH / 2, ivec2(RPCF_WIDTH), function);
  return rpcfMeanOf(0);
}

#endif
