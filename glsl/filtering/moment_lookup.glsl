// The filtered moments under a camera pixel, and the receiver's depth to compare them with.
// Include after common/receiver.glsl and lib/moments.glsl.
#ifndef EDGESHADE_MOMENT_LOOKUP
#define EDGESHADE_MOMENT_LOOKUP

layout(constant_id = 0) const bool SAMPLED = true; // by the sampler's filter; false: by texels, for formats that have none
layout(constant_id = 1) const bool MIPS = true;    // wider where a pixel covers many texels

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 3) uniform sampler2D moments;
layout(binding = 4) writeonly uniform image2D visibility;

layout(push_constant, scalar) uniform Push {
  float normal_offset;   // multiples of what a plane needs
  float depth_bias;      // share of the change of the plane's depth from the window's middle to its corner
  float width;           // of the filter, texels
  float range;           // far / near - 1, or 0 for a parallel light
  int anisotropy;        // most taps along a pixel's longer axis in the map
  float reduction;       // largest visibility that counts as shadow
  float least_deviation; // of the signed depths in a window
  float moment_bias;     // share of moments that are certainly possible, see lib/moments.glsl
  vec2 exponents;        // of the warps
} push;

// Ellipse that a pixel covers in the map, texels.
struct MapFootprint {
  vec2 along;  // the longer axis, its whole length
  float major; // that length
  float minor; // length of the shorter axis
};

MapFootprint mapFootprint(ivec2 pixel, Receiver r) {
  MapFootprint f = MapFootprint(vec2(0.0), 0.0, 0.0);
  if (!MIPS) return f;
  mat4 m = view.light_clip_from_view[0];
  LightPoint l = lightSpace(r.position, 0);
  vec3 w = rowOf(m, 3);
  vec3 u = (rowOf(m, 0) - l.ndc.x * w) * (0.5 / l.w * float(view.map_size.x));
  vec3 v = (rowOf(m, 1) - l.ndc.y * w) * (0.5 / l.w * float(view.map_size.y));
  float depth = depthAt(pixel);
  mat2 steps;
  for (int i = 0; i < 2; ++i) {
    // The point where the neighbouring pixel's ray meets the receiver's plane. A parallel projection looks along -Z everywhere.
    vec3 p = viewPosition(pixel + ivec2(1 - i, i), depth);
    vec3 ray = view.view_from_clip[2][3] == 0.0 ? vec3(0.0, 0.0, -1.0) : normalize(p);
    float facing = min(dot(r.normal, ray), -0.05);
    vec3 step = p + ray * (dot(r.normal, r.position - p) / facing) - r.position;
    steps[i] = vec2(dot(u, step), dot(v, step));
  }
  // Axes of the ellipse that the steps span.
  vec2 a = steps[0], b = steps[1];
  float xx = a.x * a.x + b.x * b.x, yy = a.y * a.y + b.y * b.y, xy = a.x * a.y + b.x * b.y;
  float middle = 0.5 * (xx + yy), apart = sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy);
  f.major = min(sqrt(middle + apart), 65536.0);
  f.minor = sqrt(max(middle - apart, 0.0));
  vec2 axis = xx >= yy ? vec2(0.5 * (xx - yy) + apart, xy) : vec2(xy, 0.5 * (yy - xx) + apart);
  float l2 = length(axis);
  f.along = l2 > 0.0 ? axis * (f.major / l2) : vec2(f.major, 0.0);
  return f;
}

vec4 bilinear(vec2 uv, int level) {
  // Some drivers answer textureSize with the level of a neighbouring thread.
  ivec2 last = max(textureSize(moments, 0) >> level, 1) - 1;
  vec2 at = uv * vec2(last + 1) - 0.5, f = fract(at);
  ivec2 low = clamp(ivec2(floor(at)), ivec2(0), last), high = clamp(ivec2(floor(at)) + 1, ivec2(0), last);
  vec4 top = mix(texelFetch(moments, low, level), texelFetch(moments, ivec2(high.x, low.y), level), f.x);
  vec4 bottom = mix(texelFetch(moments, ivec2(low.x, high.y), level), texelFetch(moments, high, level), f.x);
  return mix(top, bottom, f.y);
}

vec4 momentsAtLevel(vec2 uv, float level) {
  if (SAMPLED) return textureLod(moments, uv, level);
  int l = int(level);
  vec4 m = bilinear(uv, l);
  return level > float(l) ? mix(m, bilinear(uv, l + 1), level - float(l)) : m;
}

// Taps along the ellipse's longer axis, each as wide as the shorter one.
vec4 momentsAt(vec2 uv, MapFootprint f) {
  if (!MIPS) return momentsAtLevel(uv, 0.0);
  float across = max(max(f.minor, f.major / float(push.anisotropy)), 1.0);
  float level = min(log2(across), float(textureQueryLevels(moments) - 1));
  int taps = clamp(int(ceil(f.major / across)), 1, push.anisotropy);
  vec4 sum = vec4(0.0);
  for (int i = 0; i < taps; ++i) {
    float t = (float(i) + 0.5) / float(taps) - 0.5;
    sum += momentsAtLevel(uv + t * f.along / vec2(view.map_size), level);
  }
  return sum / float(taps);
}

// Signed depth of the receiver, bias subtracted.
float momentReference(MapReceiver m, MapFootprint f) {
  vec2 half_window = 0.5 * (push.width + max(f.major - 1.0, 0.0)) / vec2(view.map_size);
  precise float depth = m.depth - push.depth_bias * dot(abs(m.plane), half_window);
  return signedDepth(depth, push.range);
}

// Looks up the moments `b` under a pixel, and the signed depth `t` to compare them with. Returns true if the visibility
// needs no moments; `decided` then holds it.
bool lookUp(ivec2 pixel, out vec4 b, out float t, out float decided) {
  Receiver r = receiverAt(pixel);
  MapReceiver m;
  if (mapReceiver(r, push.normal_offset, 0.0, m, decided)) return true;
  MapFootprint f = mapFootprint(pixel, r);
  b = momentsAt(m.uv, f);
  t = momentReference(m, f);
  return false;
}

#endif
