// What an instance's draw needs, as src/scene/raster.rs fills it.
#ifndef EDGESHADE_INSTANCE
#define EDGESHADE_INSTANCE
#extension GL_EXT_scalar_block_layout : require

struct Instance {
  mat4 clip_from_object;   // composed in f64 on the host, relative to the view
  mat3 normal_from_object; // takes normals to the world, up to their length
  mat3 world_from_object;  // without the translation
  vec4 viewer;             // relative to the object's origin, axes of the world; where w is 0, towards it from everywhere
  uint first_triangle;     // id of the instance's first triangle
};

layout(binding = 0, scalar) readonly buffer Instances { Instance instances[]; };

#endif
