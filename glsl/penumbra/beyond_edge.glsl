// Correction of an intensity for shadows beyond the nearest edge, under an area light.
// Include after edge_seeds.glsl.
#ifndef EDGESHADE_BEYOND_EDGE
#define EDGESHADE_BEYOND_EDGE

layout(binding = 7) uniform sampler2D hard; // 0 or 1

// Eq. 8 considers the nearest edge alone: it is too dark where a shadow is thinner than its penumbra, and too light in a
// gap that is thinner than its penumbra. So taps read the hard shadows along the line through pixel and edge, over the
// width of the penumbra. The result is the mean difference between the taps and the values that a single edge would
// give. Taps within EDGE_PIXELS of the edge, and those on other surfaces, do not count.
const float EDGE_PIXELS = 1.5;

// Place of a tap on the line, from -0.5 to 0.5.
float tapPlace(int i, int taps) { return (float(i) + 0.5) / float(taps) - 0.5; }

// Pixel that shows the point of the line; the given one if the image does not show it.
ivec2 tapPixel(vec4 clip, ivec2 pixel) {
  vec2 size = vec2(view.size), place = (clip.xy / clip.w) * (0.5 * size) + 0.5 * size;
  ivec2 tap = ivec2(floor(place));
  bool inside = clip.w > 0.0 && all(greaterThanEqual(tap, ivec2(0))) && all(lessThan(tap, ivec2(view.size)));
  return inside ? tap : pixel;
}

float beyondEdge(ivec2 pixel, Receiver p, vec3 apart, float share, float own, int taps) {
  // The ends of the line, which is one penumbra width long and centred at the pixel.
  mat4 clip_from_view = inverse(view.view_from_clip);
  vec3 across = apart / share;
  vec4 middle = clip_from_view * vec4(p.position, 1.0), along = clip_from_view * vec4(across, 0.0);
  vec2 size = vec2(view.size), half_size = 0.5 * size;
  vec2 from = (middle.xy - 0.5 * along.xy) / (middle.w - 0.5 * along.w), to = (middle.xy + 0.5 * along.xy) / (middle.w + 0.5 * along.w);
  float pixels = distance(from * half_size, to * half_size), width = pixelWidth(p.position);
  float sum = 0.0;
  for (int first = 0; first < taps; first += 32) {
    // Most taps find what they expect; only the others need their surface.
    uint differing = 0;
    for (int i = first; i < min(first + 32, taps); ++i) {
      float t = tapPlace(i, taps);
      ivec2 at = tapPixel(middle + t * along, pixel);
      float expected = t < share ? own : 1.0 - own;
      bool counts = abs(t - share) * pixels >= EDGE_PIXELS && texelFetch(hard, at, 0).x != expected;
      differing |= uint(counts) << (i - first);
    }
    for (; differing != 0; differing &= differing - 1) {
      float t = tapPlace(first + findLSB(differing), taps);
      ivec2 at = tapPixel(middle + t * along, pixel);
      Receiver q = receiverAt(at);
      vec3 to_tap = q.position - p.position;
      float away = max(length(vec2(at - pixel)), 0.5);
      bool same = PLANES ? onePatch(p.normal, q.normal, to_tap, away, width, push.tolerance)
                         : sameDepth(p.position.z, q.position.z, push.tolerance);
      // The hard shadow is the opposite of what a single edge would give.
      float change = (t < share) == (own > 0.5) ? -1.0 : 1.0;
      sum += q.surface && same && at != pixel ? change : 0.0;
    }
  }
  return sum / float(max(taps, 1));
}

#endif
