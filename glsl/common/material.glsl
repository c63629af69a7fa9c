// Base colour and alpha test, with the same arithmetic as the CPU reference (src/reference/ray_traced/alpha.rs).
#ifndef EDGESHADE_MATERIAL
#define EDGESHADE_MATERIAL
#extension GL_EXT_scalar_block_layout : require

const uint WRAP_REPEAT = 0, WRAP_MIRRORED = 1, WRAP_CLAMP = 2;

layout(push_constant, scalar) uniform Push {
  vec4 base_color;
  float alpha_cutoff; // below 0: opaque
  uint wrap_u;
  uint wrap_v;
  uint nearest;
} push;

layout(binding = 1) uniform sampler2D base_color_texture;

int wrapTexel(int i, int n, uint mode) {
  if (mode == WRAP_CLAMP) return clamp(i, 0, n - 1);
  int period = mode == WRAP_MIRRORED ? 2 * n : n;
  int m = i % period;
  if (m < 0) m += period;
  return m < n ? m : 2 * n - 1 - m;
}

vec4 texelAt(ivec2 i, ivec2 size) {
  return texelFetch(base_color_texture, ivec2(wrapTexel(i.x, size.x, push.wrap_u), wrapTexel(i.y, size.y, push.wrap_v)), 0);
}

// Samples level 0, bilinear or nearest, with weights in full single precision. So a hole has the same border in the
// shadow map, the G-buffer and the ray-traced truth; the 8-bit weights of a texture unit would move it.
vec4 sampleBaseColor(vec2 uv) {
  ivec2 size = textureSize(base_color_texture, 0);
  // Far outside [0, 1] the index would overflow. Dropping whole repeats changes nothing.
  vec2 x = (uv - 2.0 * floor(0.5 * uv)) * vec2(size);
  if (push.wrap_u == WRAP_CLAMP) x.x = clamp(uv.x, -1.0, 2.0) * float(size.x);
  if (push.wrap_v == WRAP_CLAMP) x.y = clamp(uv.y, -1.0, 2.0) * float(size.y);
  if (push.nearest != 0) return texelAt(ivec2(floor(x)), size);
  x -= 0.5;
  vec2 first = floor(x), f = x - first;
  ivec2 i = ivec2(first);
  vec4 upper = mix(texelAt(i, size), texelAt(i + ivec2(1, 0), size), f.x);
  vec4 lower = mix(texelAt(i + ivec2(0, 1), size), texelAt(i + ivec2(1, 1), size), f.x);
  return mix(upper, lower, f.y);
}

#endif
