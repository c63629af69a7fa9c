// The weights of a separable filter. Include after moment_kind.glsl, which has constant 0.
#ifndef EDGESHADE_MOMENT_KERNEL
#define EDGESHADE_MOMENT_KERNEL

layout(constant_id = 1) const int WIDTH = 3;          // of the box, texels; odd
layout(constant_id = 2) const bool GAUSSIAN = false;  // false: box
layout(constant_id = 3) const int RADIUS = 1;         // texels on each side; those beyond count nothing

// A Gaussian has the variance of the box, WIDTH^2 / 12.
float kernelWeight(int i) {
  float a = float(i);
  return GAUSSIAN ? exp(-6.0 * a * a / float(WIDTH * WIDTH)) : float(2 * abs(i) < WIDTH);
}

#endif
