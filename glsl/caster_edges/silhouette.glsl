// Push constants of both stages of the picture of silhouette edges.
#ifndef EDGESHADE_SILHOUETTE
#define EDGESHADE_SILHOUETTE
#extension GL_EXT_scalar_block_layout : require

layout(push_constant, scalar) uniform Push {
  uint stride;       // floats from one vertex to the next
  uint seen;         // 1: draw the edges that the camera sees, 0: the others
  float far_depth;   // camera depth where there is no surface
  float depth_error; // of the camera depth, absolute
} push;

#endif
