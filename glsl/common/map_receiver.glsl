// A camera pixel's surface point as the shadow map sees it: place, depth and receiver plane.
// Include after common/receiver.glsl.
#ifndef EDGESHADE_MAP_RECEIVER
#define EDGESHADE_MAP_RECEIVER

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
