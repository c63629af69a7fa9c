// Converts linear scene colour to a display's code values. Binding-free.
#ifndef EDGESHADE_TONE
#define EDGESHADE_TONE

// Keeps colours up to `start`, compresses brighter ones towards 1, and fades very bright colours to white.
vec3 toneMap(vec3 color) {
  const float start = 0.6;
  float peak = max(color.r, max(color.g, color.b));
  if (peak <= start) return color;
  float room = 1.0 - start;
  float mapped = 1.0 - room * room / (peak - start + room);
  float white = 1.0 - 1.0 / (0.15 * (peak - mapped) + 1.0);
  return mix(color * (mapped / peak), vec3(mapped), white);
}

// IEC 61966-2-1.
vec3 srgbEncode(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308)));
}

#endif
