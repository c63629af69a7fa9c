// Vertices of shadow volumes, read from the casters' buffers: at their own place, or moved away from the light to
// infinity.
#ifndef EDGESHADE_VOLUME
#define EDGESHADE_VOLUME
#include "casters.glsl"

layout(binding = 0, scalar) readonly buffer Positions { float positions[]; };
layout(binding = 1, scalar) readonly buffer Lights { CasterLight lights[]; };
layout(binding = 2, scalar) readonly buffer Cameras { VolumeCamera cameras[]; };

layout(push_constant, scalar) uniform Push {
  uint stride;      // floats from one vertex to the next
  uint facing;      // for caps: facing bit of the triangles to draw
  uint infinite;    // 1: caps at infinity
  float depth_step; // added to the depth of caps that are not at infinity
  float nearness;   // 0: images lie at infinity; otherwise p's share of the way from the light to its image
} push;

// Near caps must have exactly the depth of the surfaces they lie on, so this is the same product as in gbuffer.vert.
invariant gl_Position;

vec3 positionOf(uint v) {
  uint i = v * push.stride;
  return vec3(positions[i], positions[i + 1], positions[i + 2]);
}

// The image of p at infinity. Clipping accepts such points whatever their w.
vec4 infinityOf(vec3 p, vec4 light, mat4 clip_from_object) {
  precise vec3 d = light.w * p - (1.0 - push.nearness * light.w) * light.xyz;
  precise vec4 q = clip_from_object * vec4(d, push.nearness * light.w);
  return q;
}

// Position of all corners of a triangle or quad that is not drawn.
const vec4 NOWHERE = vec4(0.0, 0.0, 0.0, 1.0);

#endif
