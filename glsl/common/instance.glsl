// Data of an instance's draw, filled by src/scene/raster.rs.
#ifndef EDGESHADE_INSTANCE
#define EDGESHADE_INSTANCE
#extension GL_EXT_scalar_block_layout : require

struct Instance {
  mat4 clip_from_object;   // composed in f64 on the host, relative to the view
  mat3 normal_from_object; // takes normals to the world, but not to unit length
  mat3 world_from_object;  // without the translation
  vec4 viewer;             // relative to the object's origin, along the world's axes; w = 0: direction to a viewer at infinity
  uint first_triangle;     // id of the instance's first triangle
};

layout(binding = 0, scalar) readonly buffer Instances { Instance instances[]; };

#endif
