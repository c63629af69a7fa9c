// Header of the list of silhouette edges.
#ifndef EDGESHADE_SILHOUETTES
#define EDGESHADE_SILHOUETTES

struct SilhouetteHeader {
  uint groups[3];   // dispatch arguments for 64 edges per workgroup
  uint count;
  uint max_weight;
  uint volumes[4];  // draw arguments for quads of shadow volumes: 6 vertices per edge, one instance per copy
  uint quads[4];    // draw arguments for one quad per edge
  uint walks[3];    // dispatch arguments for 4 edges per workgroup
};

#endif
