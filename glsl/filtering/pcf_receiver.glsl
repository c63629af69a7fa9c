// What pcf.comp and pcf_classify.comp share: a pixel is decided without the map, or has a kernel in it.
#ifndef EDGESHADE_PCF_RECEIVER
#define EDGESHADE_PCF_RECEIVER

layout(push_constant, scalar) uniform Push {
  float normal_offset; // multiples of what a plane needs
  float depth_bias;    // fraction of a texel's slope, along both axes
} push;

// True where no shadow-map texel is needed; then `decided` is the visibility.
bool pcfReceiver(ivec2 pixel, int w, out PcfKernel kernel, out float decided) {
  MapReceiver m;
  if (mapReceiver(receiverAt(pixel), push.normal_offset, push.depth_bias, m, decided)) return true;
  kernel = pcfKernel(m.uv, m.depth, m.plane, w, vec2(view.map_size));
  return false;
}

#endif
