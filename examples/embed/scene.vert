#version 460
// The ground and the box, from the vertex index alone: 36 vertices of the box, then 6 of the ground.
layout(push_constant) uniform Push {
  mat4 clip_from_world;
  vec4 box_min;
  vec4 box_max;
  vec4 ground; // half width
} push;

layout(location = 0) out vec3 normal;

const vec2 CORNERS[6] = vec2[](vec2(0, 0), vec2(1, 0), vec2(1, 1), vec2(0, 0), vec2(1, 1), vec2(0, 1));

void main() {
  vec2 corner = CORNERS[gl_VertexIndex % 6];
  vec3 p;
  if (gl_VertexIndex < 36) {
    int face = gl_VertexIndex / 6, axis = face % 3, side = face / 3;
    vec3 unit;
    unit[axis] = float(side);
    unit[(axis + 1) % 3] = corner.x;
    unit[(axis + 2) % 3] = corner.y;
    p = mix(push.box_min.xyz, push.box_max.xyz, unit);
    normal = vec3(0.0);
    normal[axis] = side == 0 ? -1.0 : 1.0;
  } else {
    vec2 xz = (2.0 * corner - 1.0) * push.ground.x;
    p = vec3(xz.x, 0.0, xz.y);
    normal = vec3(0.0, 1.0, 0.0);
  }
  gl_Position = push.clip_from_world * vec4(p, 1.0);
}
