// Triangle and instance of a vertex. Vertices are numbered by the chunks of the casters' triangles, 3 CHUNK vertices
// per chunk. Include after volume.glsl.
#ifndef EDGESHADE_VOLUME_TRIANGLE
#define EDGESHADE_VOLUME_TRIANGLE

layout(binding = 3, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(binding = 4, scalar) readonly buffer Chunks { uint chunks[]; }; // instance of each chunk
layout(binding = 5, scalar) readonly buffer Instances { CasterInstance instances[]; };
layout(binding = 6, scalar) readonly buffer Facing { uint facing[]; };

// Facing bit of triangle `t` in the instance whose first bit is given.
bool facesLight(uint first_bit, uint t) {
  uint bit = first_bit + t;
  return (facing[bit >> 5] >> (bit & 31u) & 1u) != 0;
}

// Tests whether a triangle counts. In mirrored instances the facing bits are inverted, so that they tell the winding in
// the world; the outer side of a closed shell does not change.
bool counts(uint instance, bool faces) {
  return cameras[instance].shells == 0 || faces == (lights[instance].orientation > 0.0);
}

#endif
