#version 460
// One axis of the separable mean filter over the penumbra. Taps lie on the pixel's own surface, evenly spaced over a
// constant world width. Macedo, Apolinario (2018), eq. 9-10.
// If penumbrae have widths of their own (SOFT), the filter's width is by default a share of the pixel's penumbra width;
// the paper's is constant (Macedo, Apolinario (2017), eq. 4; SOFT = false).
// Departures: the filter skips pixels away from the penumbra and takes no more taps than pixels. Positions and normals
// tell which taps lie on the surface (PLANES).
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "edge_seeds.glsl"

layout(constant_id = 1) const bool VERTICAL = false; // second pass, which writes the visibility
layout(constant_id = 2) const int TAPS = 15;         // maximum; odd
layout(constant_id = 3) const bool SOFT = false;

layout(local_size_x = 8, local_size_y = 8) in;

// Intensity and packed normal, wherever a tap may fall. Out of the penumbra's reach the intensity is lowered by 2, so
// it is negative.
layout(binding = 3) uniform sampler2D source;
layout(binding = 4) writeonly uniform image2D target;
layout(binding = 5, scalar) readonly buffer TileList {
  uint groups[3];
  uint count;
  uint tiles[];
} list;
layout(binding = 6) uniform sampler2D pixel_widths; // widths of penumbrae, world units; read if SOFT

float meanOnSurface(ivec2 pixel, float own) {
  const int axis = VERTICAL ? 1 : 0;
  Receiver p = receiverAt(pixel);
  float width = pixelWidth(p.position), filter_width = push.filter_width;
  if (SOFT) filter_width *= texelFetch(pixel_widths, pixel, 0).x;
  float pixels = filter_width / width;
  if (!(pixels > 1.0)) return own;
  // One tap per pixel of the filter's width, made odd, at most TAPS.
  int half_taps = min(TAPS, int(min(ceil(pixels), 64.0)) | 1) / 2;
  float between = half_taps > 0 ? 0.5 * pixels / float(half_taps) : 0.0;
  float sum = own, count = 1.0;
  int last = int(view.size[axis]) - 1;
  for (int i = -half_taps; i <= half_taps; ++i) {
    int offset = int(round(between * float(i)));
    ivec2 at = pixel;
    at[axis] += offset;
    ivec2 inside = clamp(at, ivec2(0), ivec2(view.size) - 1);
    vec2 tap = texelFetch(source, inside, 0).xy;
    float depth = depthAt(inside);
    vec3 q = viewPosition(inside, depth), normal = unpackNormal(tap.y);
    bool same = PLANES ? dot(p.normal, normal) >= CREASE_COSINE &&
                           onePatch(p.normal, normal, q - p.position, abs(float(offset)), width, push.tolerance)
                       : sameDepth(p.position.z, q.z, push.tolerance);
    // The middle tap is counted already.
    bool taken = same && i != 0 && at[axis] >= 0 && at[axis] <= last && depth != view.far_depth;
    sum += taken ? (tap.x < -0.5 ? tap.x + 2.0 : tap.x) : 0.0;
    count += taken ? 1.0 : 0.0;
  }
  return sum / count;
}

void main() {
  for (uint i = gl_WorkGroupID.x; i < list.count; i += gl_NumWorkGroups.x) {
    ivec2 pixel = unpackTile(list.tiles[i]) * TILE + ivec2(gl_LocalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(view.size)))) continue;
    vec2 own = texelFetch(source, pixel, 0).xy;
    bool near = own.x >= -0.5;
    if (near) own.x = meanOnSurface(pixel, own.x);
    if (near || !VERTICAL) imageStore(target, pixel, vec4(own, 0.0, 0.0));
  }
}
