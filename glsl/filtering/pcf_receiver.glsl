// Common part of pcf.comp and pcf_classify.comp: a pixel either needs no texel of the map, or has a kernel in it.
// Include after common/receiver.glsl and lib/pcf.glsl.
#ifndef EDGESHADE_PCF_RECEIVER
#define EDGESHADE_PCF_RECEIVER

layout(constant_id = 4) const bool NEAREST = false; // w x w single texels, without bilinear weights
layout(constant_id = 5) const bool FIXED = false;   // the point's own depth instead of the receiver's plane

layout(push_constant, scalar) uniform Push {
  float normal_offset; // multiples of the offset that a plane needs
  float depth_bias;    // fraction of the plane's change of depth per texel, over both axes
} push;

// Returns true if the visibility needs no texel of the shadow map; `decided` then holds it.
bool pcfReceiver(ivec2 pixel, int w, out PcfKernel kernel, out float decided) {
  MapReceiver m;
  if (mapReceiver(receiverAt(pixel), push.normal_offset, push.depth_bias, m, decided)) return true;
  vec2 plane = FIXED ? vec2(0.0) : m.plane;
  if (NEAREST) kernel = pcfNearestKernel(m.uv, m.depth, plane, w, vec2(view.map_size));
  else kernel = pcfKernel(m.uv, m.depth, plane, w, vec2(view.map_size));
  return false;
}

#endif
