// Visibility from the distance to an edge: Kenzel, "Edge Distance Shadow Mapping" (2013), section 6.1 and figure 6.1.
#ifndef EDGESHADE_EDSM_BORDER
#define EDGESHADE_EDSM_BORDER

const int BOX = 0, SMOOTHSTEP = 1, DISC = 2;

// `x` is the distance in half widths of the border, positive in shadow.
float borderVisibility(float x, int kernel) {
  x = clamp(x, -1.0, 1.0);
  if (kernel == BOX) return 0.5 - 0.5 * x;
  if (kernel == SMOOTHSTEP) return 1.0 - smoothstep(-1.0, 1.0, x);
  // Area of a disc beyond a straight edge, as a share.
  return clamp((acos(x) - x * sqrt(max(1.0 - x * x, 0.0))) / 3.14159265, 0.0, 1.0);
}

#endif
