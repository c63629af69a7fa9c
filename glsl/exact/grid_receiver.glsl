// A receiver in the light's grid. Include after common/receiver.glsl and grid.glsl.
#ifndef EDGESHADE_GRID_RECEIVER
#define EDGESHADE_GRID_RECEIVER

struct GridReceiver {
  vec2 ndc;
  float depth;
  uint cell;
  LightPoint point;
};

// Returns true if the visibility needs no caster; `decided` then holds it. The receiver moves along its normal by the
// bound of its position's error, in the camera's and in the light's view, so that it lies in front of its own surface.
const float RASTER_DEPTH = 1.0 / 16777216.0;

bool gridReceiver(ivec2 pixel, Receiver r, out GridReceiver g, out float decided) {
  decided = 1.0;
  if (!r.surface) return true;
  if (dot(r.normal, towardsLight(r.position, 0)) <= 0.0) {
    decided = 0.0;
    return true;
  }
  LightPoint l = lightSpace(r.position, 0);
  if (!l.inside) return true;
  float reach = length(r.position);
  vec4 light = view.light_position_view[0];
  if (light.w != 0.0) reach += length(light.xyz - r.position);
  else reach += view.light_area[0].w + texelSize(view.light_clip_from_view[0], l, vec2(1.0));
  float off = abs(dot(r.normal, viewPosition(pixel, depthAt(pixel) + RASTER_DEPTH) - r.position));
  precise vec3 p = r.position + r.normal * (r.error + POSITION_ULPS * reach + off);
  l = lightSpace(p, 0);
  if (!l.inside) return true;
  g.point = l;
  g.ndc = l.ndc;
  precise float depth = push.spot != 0 ? -1.0 / l.w : l.depth;
  g.depth = depth;
  uvec2 cell = min(uvec2(l.uv * float(push.cells)), push.cells - 1);
  g.cell = cell.y * push.cells + cell.x;
  return false;
}

#endif
