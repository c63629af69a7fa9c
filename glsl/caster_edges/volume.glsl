// Vertices of shadow volumes, pulled from the casters' buffers: at their place or infinitely far away from the light.
#ifndef EDGESHADE_VOLUME
#define EDGESHADE_VOLUME
#include "casters.glsl"
#include "volumes.glsl"

layout(binding = 0, scalar) readonly buffer Positions { float positions[]; };
layout(binding = 1, scalar) readonly buffer Lights { CasterLight lights[]; };
layout(binding = 2, scalar) readonly buffer Cameras { VolumeCamera cameras[]; };

layout(push_constant, scalar) uniform Push {
  uint stride;      // floats from a vertex to the next
  uint facing;      // caps: of the triangles with this facing bit
  uint infinite;    // 1: caps at infinity
  float depth_step; // caps at their place: added to their depth
  float nearness;   // 0: infinity is infinitely far away; else its part of the way from the light
} push;

// Near caps must have the depth of the surfaces that they lie on, bit by bit: the same product as in gbuffer.vert.
invariant gl_Position;

vec3 positionOf(uint v) {
  uint i = v * push.stride;
  return vec3(positions[i], positions[i + 1], positions[i + 2]);
}

// Clipping takes points at infinity as they are, whatever their w.
vec4 infinityOf(vec3 p, vec4 light, mat4 clip_from_object) {
  precise vec3 d = light.w * p - (1.0 - push.nearness * light.w) * light.xyz;
  precise vec4 q = clip_from_object * vec4(d, push.nearness * light.w);
  return q;
}

// Of a triangle or quad that is not drawn: all corners in one place.
const vec4 NOWHERE = vec4(0.0, 0.0, 0.0, 1.0);

#endif
