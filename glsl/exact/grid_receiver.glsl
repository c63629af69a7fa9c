// A receiver in the light's grid. Include after common/receiver.glsl and grid.glsl.
#ifndef EDGESHADE_GRID_RECEIVER
#define EDGESHADE_GRID_RECEIVER

struct GridReceiver {
  vec2 ndc;
  float depth;
  bool grazing;     // the light may reach below the receiver's plane
  LightPoint point;
};

// Bound of the error of a stored camera depth: rasterisers interpolate the depth of a triangle that reaches up to the
// near plane with this absolute error.
const float RASTER_DEPTH = 1.0 / 16777216.0;
// Largest share of the distance that is allowed for it. Near planes that are closer still would take in everything.
const float RASTER_MOST = 1.0 / 1024.0;

// Returns true if the visibility needs no caster; `decided` then holds it. The receiver moves towards the light, which
// leaves its place in the light's image as it is, until it lies in front of its own plane by the bound of its
// position's error in the camera's and in the light's view. Both views transform vertices in single precision, which loses
// digits where these lie far from the origin of their own space.
bool gridReceiver(ivec2 pixel, Receiver r, out GridReceiver g, out float decided) {
  decided = 1.0;
  if (!r.surface) return true;
  vec3 light = towardsLight(r.position, 0);
  float facing = dot(r.normal, light);
  if (facing <= 0.0) {
    decided = 0.0;
    return true;
  }
  LightPoint l = lightSpace(r.position, 0);
  if (!l.inside) return true;
  bool spot = push.spot != 0;
  // Both are computed, and no branch depends on the frame's constants alone (common/receiver.glsl).
  float to_spot = distance(view.light_position_view[0].xyz, r.position);
  float of_sun = view.light_area[0].w + texelSize(view.light_clip_from_view[0], l, vec2(1.0));
  float away = spot ? to_spot : of_sun;
  float raster = min(abs(dot(r.normal, viewPosition(pixel, depthAt(pixel) + RASTER_DEPTH) - r.position)),
                     RASTER_MOST * length(r.position));
  float error = r.error + POSITION_ULPS * (length(r.position) + away + push.far_vertices) + raster;
  g.point = l;
  // Half the diagonal of the light, at its distance.
  float light_distance = spot ? to_spot : 1.0;
  g.grazing = facing * light_distance < 1.4143 * view.light_area[0].z;
  g.ndc = l.ndc;
  float step = error / facing;
  precise float below_spot = -1.0 / (l.w * max(1.0 - step / away, 1e-3));
  precise float below_sun = l.depth - step / view.light_area[0].w;
  g.depth = spot ? below_spot : below_sun;
  return false;
}

#endif
