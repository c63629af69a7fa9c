#version 460
// Shadow mapping: one test per pixel, against the texel that its point falls into.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "common/shadow_map_test.glsl"
#include "common/pixel_steps.glsl" // all pixels, or those that another pass listed

layout(binding = 3) uniform sampler2DArray shadow_map;

layout(push_constant, scalar) uniform Push {
  float normal_offset; // multiples of the offset that a plane needs
  float depth_bias;    // depth units, in addition
} push;

float visibilityAt(ivec2 pixel) {
  Receiver r = receiverAt(pixel);
  if (!r.surface) return 1.0;
  if (dot(r.normal, towardsLight(r.position, 0)) <= 0.0) return 0.0;
  LightPoint l = lightSpace(r.position, 0);
  if (!l.inside) return 1.0;
  return shadowMapTest(shadow_map, r, l, push.normal_offset, push.depth_bias);
}

void main() {
  if (readsList()) {
    for (uint i = firstListed(); i < list.count; i += listStride()) {
      ivec2 pixel = unpackTile(list.pixels[i]);
      imageStore(visibility, pixel, vec4(visibilityAt(pixel)));
    }
    return;
  }
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (all(lessThan(pixel, ivec2(view.size)))) imageStore(visibility, pixel, vec4(visibilityAt(pixel)));
}
