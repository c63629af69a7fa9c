// What shaders know of casters: src/casters/gpu.rs and src/technique/caster_edges/silhouettes.rs fill it.
#ifndef EDGESHADE_CASTERS
#define EDGESHADE_CASTERS
#extension GL_EXT_scalar_block_layout : require

// Triangles, or edges, of a workgroup.
const uint CHUNK = 64;
// A face of an edge, by how the triangle runs: bit 31 set from v1 to v0.
const uint REVERSED = 0x80000000u, BOUNDARY = 0xFFFFFFFFu, NON_MANIFOLD = 0xFFFFFFFEu;

// The same from frame to frame.
struct CasterInstance {
  uint first_triangle;       // in the list of triangles
  uint triangles;
  uint first_triangle_chunk; // workgroup; facing bit of triangle t: CHUNK * first_triangle_chunk + t
  uint first_edge;
  uint edges;
  uint first_edge_chunk;
  uint outward;              // 1: closed, with the outer side outside
};

// As a light sees it.
struct CasterLight {
  mat4 clip_from_object; // composed in f64
  vec4 light;            // object space: w = 1 position, w = 0 towards the light
  float orientation;     // -1 where the transform mirrors
  uint casts;            // 0: left out
  uint shell;            // 1: its front faces alone tell what it shadows
};

// An edge that bounds a shadow, or counts for a shadow volume. Seen from the light with its image's y down, the occluder
// lies on the right of a -> b.
struct SilhouetteEdge {
  uint a, b;     // vertices
  uint instance;
  uint flags;
  uint face; // triangle of the occluder beside it, one that faces the light if any does
};
const uint SILHOUETTE_WEIGHT = 0xFFFFu; // how many sides of a shadow volume stand on it
const uint SILHOUETTE_BOUNDARY = 1u << 16; // one face only
const uint SILHOUETTE_OUTLINE = 1u << 17;  // nothing of the surface continues beyond it

// Workgroups are numbered along x, then y.
const uint MAX_GROUPS_X = 65535;
uint chunkIndex(uvec3 group) { return group.x + MAX_GROUPS_X * group.y; }

#endif
