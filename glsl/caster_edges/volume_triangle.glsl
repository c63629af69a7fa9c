// Which triangle of which instance a vertex belongs to, where vertices are numbered by the chunks of the casters'
// triangles: 3 CHUNK a chunk.
#ifndef EDGESHADE_VOLUME_TRIANGLE
#define EDGESHADE_VOLUME_TRIANGLE

layout(binding = 3, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(binding = 4, scalar) readonly buffer Chunks { uint chunks[]; }; // instance of each
layout(binding = 5, scalar) readonly buffer Instances { CasterInstance instances[]; };
layout(binding = 6, scalar) readonly buffer Facing { uint facing[]; };

// Of triangle `t` in the instance whose first bit this is.
bool facesLight(uint first_bit, uint t) {
  uint bit = first_bit + t;
  return (facing[bit >> 5] >> (bit & 31u) & 1u) != 0;
}

// Mirrored instances have their bits turned round, so that they say how a triangle is wound in the world; a closed shell's
// outer side is what it was.
bool counts(uint instance, bool faces) {
  return cameras[instance].shells == 0 || faces == (lights[instance].orientation > 0.0);
}

#endif
