// What pcf.comp and pcf_classify.comp share: a pixel is decided without the map, or has a kernel in it.
#ifndef EDGESHADE_PCF_RECEIVER
#define EDGESHADE_PCF_RECEIVER
#include "receiver.glsl"
#include "lib/pcf.glsl"

layout(push_constant, scalar) uniform Push {
  float normal_offset; // multiples of what a plane needs
  float depth_bias;    // fraction of a texel's slope, along both axes
} push;

// True where no shadow-map texel is needed; then `decided` is the visibility.
bool pcfReceiver(ivec2 pixel, int w, out PcfKernel kernel, out float decided) {
  decided = 1.0;
  Receiver r = receiverAt(pixel);
  if (!r.surface) return true;
  if (dot(r.normal, towardsLight(r.position, 0)) <= 0.0) {
    decided = 0.0;
    return true;
  }
  LightPoint l = lightSpace(r.position, 0);
  if (!l.inside) return true;
  l = lightSpace(offsetReceiver(r, l, push.normal_offset, 0), 0);
  if (!l.inside) return true;
  vec2 plane = receiverPlane(view.light_clip_from_view[0], view.light_depth_scale[0], l, r.normal);
  vec2 map_size = vec2(view.map_size);
  vec2 slope = abs(plane) / map_size;
  float bias = DEPTH_ULPS + push.depth_bias * (slope.x + slope.y);
  kernel = pcfKernel(l.uv, l.depth, plane, bias, w, map_size);
  return false;
}

#endif
