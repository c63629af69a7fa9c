// Data of the casters, filled by src/casters/gpu.rs and src/technique/caster_edges/silhouettes.rs.
#ifndef EDGESHADE_CASTERS
#define EDGESHADE_CASTERS
#extension GL_EXT_scalar_block_layout : require

// Triangles or edges per workgroup.
const uint CHUNK = 64;
// A face of an edge is a triangle's index, with bit 31 set if the triangle runs the edge from v1 to v0.
const uint REVERSED = 0x80000000u, BOUNDARY = 0xFFFFFFFFu, NON_MANIFOLD = 0xFFFFFFFEu;

// Part of an instance that does not change from frame to frame.
struct CasterInstance {
  uint first_triangle;       // index in the list of triangles
  uint triangles;
  uint first_triangle_chunk; // index of a workgroup; the facing bit of triangle t is CHUNK * first_triangle_chunk + t
  uint first_edge;
  uint edges;
  uint first_edge_chunk;
  uint outward;              // 1: closed, with normals pointing outwards
};

// An instance as a light sees it.
struct CasterLight {
  mat4 clip_from_object; // composed in f64
  vec4 light;            // object space; w = 1: position, w = 0: direction towards the light
  float orientation;     // -1 if the transform mirrors
  uint casts;            // 0: casts no shadow
  uint shell;            // 1: its front faces alone determine its shadow
};

// An edge that bounds a shadow or counts for a shadow volume. Seen from the light, the occluder lies to the left of
// a -> b.
struct SilhouetteEdge {
  uint a, b;     // vertices
  uint instance;
  uint flags;
  uint face; // adjacent triangle of the occluder; one that faces the light if there is any
};
const uint SILHOUETTE_WEIGHT = 0xFFFFu; // number of sides of a shadow volume that stand on it
const uint SILHOUETTE_BOUNDARY = 1u << 16; // the edge has a single face
const uint SILHOUETTE_OUTLINE = 1u << 17;  // the surface does not continue beyond the edge

// Header of the list of silhouette edges.
struct SilhouetteHeader {
  uint groups[3];   // dispatch arguments for 64 edges per workgroup
  uint count;
  uint max_weight;
  uint volumes[4];  // draw arguments for quads of shadow volumes: 6 vertices per edge, one instance per copy
  uint quads[4];    // draw arguments for one quad per edge
  uint walks[3];    // dispatch arguments for 4 edges per workgroup
};

// An instance as the camera sees it, for shadow volumes; filled by src/technique/caster_edges/volumes.rs.
struct VolumeCamera {
  mat4 clip_from_object; // composed in f64, like the one of the G-buffer
  uint shells;           // 1: only triangles that face the light count, each edge once
};

// Workgroups are numbered along x, then y.
const uint MAX_GROUPS_X = 65535;
uint chunkIndex(uvec3 group) { return group.x + MAX_GROUPS_X * group.y; }

#endif
