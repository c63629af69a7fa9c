// What both stages of the picture of silhouette edges are told.
#ifndef EDGESHADE_SILHOUETTE
#define EDGESHADE_SILHOUETTE
#extension GL_EXT_scalar_block_layout : require

layout(push_constant, scalar) uniform Push {
  uint stride;       // floats from a vertex to the next
  uint seen;         // 1: what the camera sees of the edges, 0: what it does not
  float far_depth;   // what a cleared camera depth holds
  float depth_error; // of the camera depth, absolute
} push;

#endif
