// A camera pixel's surface point: position and normal in the camera's view space; then place, depth and plane in the
// shadow map.
#ifndef EDGESHADE_RECEIVER
#define EDGESHADE_RECEIVER
#include "lib/shadow_test.glsl"
#include "lib/octahedral.glsl"
#include "lib/light_space.glsl"
#include "view.glsl"

// No branch here depends on constants of the frame alone: Mesa 22.3's CPU driver would put their values into the code and
// compile the shader once more in every dispatch, which takes it up to ten milliseconds. Selections between values are no
// branches, and a condition that also depends on the pixel is left alone.

layout(binding = 1) uniform sampler2D camera_depth;
layout(binding = 2) uniform sampler2D camera_normal; // unused if view.normal_encoding is NORMAL_NONE

struct Receiver {
  vec3 position;
  vec3 normal;   // unit length, on the viewer's side
  float error;   // bound of the position's error, world units
  bool surface;  // false: sky
};

float depthAt(ivec2 pixel) { return texelFetch(camera_depth, pixel, 0).x; }

// Derives the geometric normal from neighbouring depths. Along each axis it takes the neighbour that more likely lies
// on the same surface: the depths of a plane are linear in the image, so it takes the side whose two pixels predict the
// pixel's own depth best. So the normals on both sides of a crease are those of its faces. Without any usable neighbour
// the normal points towards the viewer. If the result is not `wanted`, no neighbour is read: a CPU driver executes both
// sides of every branch, but not every round of a loop.
vec3 normalFromDepth(ivec2 pixel, vec3 p, bool wanted) {
  ivec2 last = ivec2(view.size) - 1;
  float own = depthAt(pixel);
  int neighbours = all(bvec2(wanted, abs(p.z) < 3.0e38)) ? 4 : 0; // positions are finite
  vec3 right = vec3(0.0), down = vec3(0.0);
  float nearest_right = 3.0e38, nearest_down = 3.0e38;
  for (int i = 0; i < neighbours; ++i) {
    int side = 2 * (i & 1) - 1;
    bool vertical = i > 1;
    ivec2 q = pixel + (vertical ? ivec2(0, side) : ivec2(side, 0));
    if (any(lessThan(q, ivec2(0))) || any(greaterThan(q, last))) continue;
    float depth = depthAt(q);
    if (depth == view.far_depth) continue;
    vec3 d = viewPosition(q, depth) - p;
    ivec2 beyond = 2 * q - pixel, inside = clamp(beyond, ivec2(0), last);
    float depth_beyond = depthAt(inside);
    precise float step = depth - own, step_beyond = depth_beyond - depth, bend = step_beyond - step;
    float off = abs(step);
    if (beyond == inside && depth_beyond != view.far_depth) off = min(off, abs(bend));
    if (off < (vertical ? nearest_down : nearest_right)) {
      if (vertical) {
        nearest_down = off;
        down = float(side) * d;
      } else {
        nearest_right = off;
        right = float(side) * d;
      }
    }
  }
  vec3 n = cross(down, right);
  float l = length(n);
  if (!(l > 0.0)) return vec3(0.0, 0.0, 1.0);
  n /= l;
  // A parallel projection looks along -Z everywhere.
  vec3 ray = view.view_from_clip[2][3] == 0.0 ? vec3(0.0, 0.0, -1.0) : p;
  return dot(n, ray) > 0.0 ? -n : n;
}

vec3 normalAt(ivec2 pixel, vec3 p) {
  bool none = view.normal_encoding == NORMAL_NONE;
  vec3 from_depth = normalFromDepth(pixel, p, none);
  vec3 e = texelFetch(camera_normal, pixel, 0).xyz;
  vec2 octahedral = view.normal_encoding == NORMAL_OCTAHEDRAL_UNSIGNED ? 2.0 * e.xy - 1.0 : e.xy;
  vec3 from_octahedral = octahedralDecode(octahedral), from_cartesian = normalize(e);
  vec3 n = view.view_from_world * (view.normal_encoding == NORMAL_CARTESIAN ? from_cartesian : from_octahedral);
  return none ? from_depth : n;
}

Receiver receiverAt(ivec2 pixel) {
  Receiver r;
  float depth = depthAt(pixel);
  r.surface = depth != view.far_depth;
  r.position = vec3(0.0);
  r.normal = vec3(0.0, 0.0, 1.0);
  r.error = 0.0;
  if (!r.surface) return r;
  r.position = viewPosition(pixel, depth);
  r.normal = normalAt(pixel, r.position);
  r.error = POSITION_ULPS * length(r.position);
  // Depth formats other than reversed floating point lose much more than single precision far away. For reversed floating
  // point this adds 0.
  r.error += distance(r.position, viewPosition(pixel, depth + view.depth_error));
  return r;
}

// Returns the point to look up in the shadow map: the receiver moved along its normal by `texels` times the offset that
// a plane needs (planeOffsetTexels), plus the bound of its position's error.
vec3 offsetReceiver(Receiver r, LightPoint l, float texels, int layer) {
  mat4 m = view.light_clip_from_view[layer];
  float offset = texels * texelSize(m, l, vec2(view.map_size)) * planeOffsetTexels(m, r.normal);
  precise vec3 p = r.position + r.normal * (offset + r.error);
  return p;
}

// The same point as the shadow map sees it.
struct MapReceiver {
  vec2 uv;
  float depth;       // bias subtracted
  vec2 plane;        // d(depth)/d(uv) of the receiver's plane
  float texel_depth; // change of depth over a texel's world size along the light's axis
};

// Returns true if the visibility needs no texel of the shadow map; `decided` then holds it. `normal_offset` is in
// multiples of the offset that a plane needs. `depth_bias` is a fraction of the plane's change of depth per texel, summed over
// both axes.
bool mapReceiver(Receiver r, float normal_offset, float depth_bias, out MapReceiver m, out float decided) {
  decided = 1.0;
  if (!r.surface) return true;
  if (dot(r.normal, towardsLight(r.position, 0)) <= 0.0) {
    decided = 0.0;
    return true;
  }
  LightPoint l = lightSpace(r.position, 0);
  if (!l.inside) return true;
  l = lightSpace(offsetReceiver(r, l, normal_offset, 0), 0);
  if (!l.inside) return true;
  m.uv = l.uv;
  m.plane = receiverPlane(view.light_clip_from_view[0], view.light_depth_scale[0], l, r.normal);
  vec2 map_size = vec2(view.map_size), slope = abs(m.plane) / map_size;
  float bias = DEPTH_ULPS + depth_bias * (slope.x + slope.y);
  precise float depth = l.depth - bias;
  m.depth = depth;
  m.texel_depth = texelDepth(view.light_clip_from_view[0], view.light_depth_scale[0], l, map_size);
  return false;
}

#endif
