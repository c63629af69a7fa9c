#version 460
// Draws silhouette edges in the camera's view, one line each. It shares its draw arguments with the quads, so there are
// 6 vertices per edge: the first two make the line, the others make lines that are not drawn.
#extension GL_GOOGLE_include_directive : require
#include "casters.glsl"
#include "silhouette.glsl"

layout(binding = 0, scalar) readonly buffer Positions { float positions[]; };
layout(binding = 1, scalar) readonly buffer Cameras { VolumeCamera cameras[]; };
layout(binding = 2, scalar) readonly buffer Silhouettes { SilhouetteEdge silhouettes[]; };

layout(location = 0) flat out uint flags;

void main() {
  SilhouetteEdge s = silhouettes[gl_VertexIndex / 6];
  uint corner = gl_VertexIndex % 6;
  // The line is the same whichever way its edge runs.
  uint i = push.stride * (corner == 0 ? min(s.a, s.b) : max(s.a, s.b));
  vec3 p = vec3(positions[i], positions[i + 1], positions[i + 2]);
  flags = s.flags;
  // Unused vertices lie outside the clip volume.
  gl_Position = corner < 2 ? cameras[s.instance].clip_from_object * vec4(p, 1.0) : vec4(-2.0, -2.0, 0.0, 1.0);
}
