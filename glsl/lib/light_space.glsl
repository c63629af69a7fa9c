// A point of the camera's view space in the shadow map: position, depth, and the receiver's plane. Binding-free:
// include it anywhere. World and view spaces are right-handed. The map's depth runs from 0 near to 1 far, and v points
// down.
#ifndef EDGESHADE_LIGHT_SPACE
#define EDGESHADE_LIGHT_SPACE

// A point in shadow-map space.
struct LightPoint {
  vec2 uv;     // [0, 1] inside the map
  float depth; // depth as the map stores it: 0 near to 1 far
  float w;     // distance along the light's axis (1 for a directional light)
  vec2 ndc;
  bool inside; // within the light's frustum; points outside it count as lit
};

LightPoint lightPoint(mat4 light_clip_from_view, vec3 p) {
  precise vec4 q = light_clip_from_view * vec4(p, 1.0);
  precise LightPoint l;
  l.w = q.w;
  // Never divide by a w that does not lie in front of the light.
  l.inside = q.w > 0.0 && q.z >= 0.0 && q.z <= q.w && all(lessThanEqual(abs(q.xy), vec2(q.w)));
  float r = l.inside ? 1.0 / q.w : 0.0;
  l.ndc = q.xy * r;
  l.uv = 0.5 * l.ndc + 0.5;
  l.depth = q.z * r;
  return l;
}

vec3 rowOf(mat4 m, int row) { return vec3(m[0][row], m[1][row], m[2][row]); }

// World size of a texel at a point's depth, along the wider axis of the texel.
float texelSize(mat4 light_clip_from_view, LightPoint l, vec2 map_size) {
  vec2 scale = vec2(length(rowOf(light_clip_from_view, 0)), length(rowOf(light_clip_from_view, 1))) * map_size;
  precise float size = 2.0 * l.w / min(scale.x, scale.y);
  return size;
}

// Change of the stored depth over a texel's world size along the light's axis.
float texelDepth(mat4 light_clip_from_view, float depth_scale, LightPoint l, vec2 map_size) {
  float spot = depth_scale / (l.w * l.w), sun = length(rowOf(light_clip_from_view, 2));
  float depth_per_unit = depth_scale > 0.0 ? spot : sun;
  precise float depth = depth_per_unit * texelSize(light_clip_from_view, l, map_size);
  return depth;
}

// Distance, in units of texelSize, by which a point of a plane must move along the plane's normal `n` so that it lies
// in front of the depth that the map stores for the plane. The centre of the point's texel is at most half a texel away
// along each axis. There the plane's depth differs by at most (|n_u| + |n_v|)/2 over the cosine between normal and ray.
// A move along the normal is lengthened along the ray by the same factor, which cancels.
float planeOffsetTexels(mat4 light_clip_from_view, vec3 n) {
  precise float texels = 0.5 * (abs(dot(n, normalize(rowOf(light_clip_from_view, 0)))) +
                                abs(dot(n, normalize(rowOf(light_clip_from_view, 1)))));
  return texels;
}

// Receiver plane: d(depth)/d(uv) over the plane with normal `n` through the point, exact for both projections.
// `depth_scale` is near*far/(far-near) for a perspective light and 0 for a parallel one.
// Let U, V, D be the gradients of u, v and depth in space, and g the result. Then D - g.u U - g.v V is parallel to n; a
// cross product with n and a dot product give the two triple products below. A plane seen edge-on has no such slope;
// the result is then 0, which means a fixed depth.
vec2 receiverPlane(mat4 light_clip_from_view, float depth_scale, LightPoint l, vec3 n) {
  vec3 x = rowOf(light_clip_from_view, 0), y = rowOf(light_clip_from_view, 1);
  vec3 z = rowOf(light_clip_from_view, 2), w = rowOf(light_clip_from_view, 3);
  float r = 1.0 / l.w;
  vec3 U = 0.5 * r * (x - l.ndc.x * w);
  vec3 V = 0.5 * r * (y - l.ndc.y * w);
  vec3 D_spot = depth_scale * r * r * w;
  vec3 D = depth_scale > 0.0 ? D_spot : z;
  vec3 area = cross(U, V);
  float facing = dot(n, area);
  if (abs(facing) < 1e-3 * length(area)) return vec2(0.0);
  precise vec2 plane = vec2(dot(n, cross(D, V)), dot(n, cross(U, D))) / facing;
  return plane;
}

#endif
