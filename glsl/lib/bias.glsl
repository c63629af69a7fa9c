// The bias that all techniques share: it covers what single precision loses, and does not depend on the scene's scale.
#ifndef EDGESHADE_BIAS
#define EDGESHADE_BIAS

// Relative error of a view-space position reconstructed from a D32 depth and carried through two f32 matrices.
const float POSITION_ULPS = 4.0 / 8388608.0;
// Absolute error of a depth in [0, 1]: the map's own rasterisation and the receiver's transform.
const float DEPTH_ULPS = 4.0 / 8388608.0;

#endif
