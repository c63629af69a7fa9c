// What shadow volumes know of an instance of the casters.
#ifndef EDGESHADE_VOLUMES
#define EDGESHADE_VOLUMES

// An instance as the camera sees it, as src/technique/caster_edges/volumes.rs fills it.
struct VolumeCamera {
  mat4 clip_from_object; // composed in f64 as the host's G-buffer composes it
  uint shells;           // 1: only triangles that face the light count, each edge once
};

#endif
