// The list of silhouette edges: what stands before it.
#ifndef EDGESHADE_SILHOUETTES
#define EDGESHADE_SILHOUETTES

struct SilhouetteHeader {
  uint groups[3];   // to work on the list by indirect dispatch, 64 edges a workgroup
  uint count;
  uint max_weight;
  uint volumes[4];  // to draw quads of shadow volumes: 6 vertices an edge, an instance for each copy
  uint quads[4];    // to draw a quad an edge
  uint walks[3];    // 4 edges a workgroup
};

#endif
