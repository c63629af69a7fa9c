// Data of an instance for shadow volumes. Include after casters.glsl.
#ifndef EDGESHADE_VOLUMES
#define EDGESHADE_VOLUMES

// An instance as the camera sees it; filled by src/technique/caster_edges/volumes.rs.
struct VolumeCamera {
  mat4 clip_from_object; // composed in f64, like the one of the G-buffer
  uint shells;           // 1: only triangles that face the light count, each edge once
};

#endif
