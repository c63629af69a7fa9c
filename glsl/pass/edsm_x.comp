#version 460
// Edge distance shadow maps with edge identities: hard shadows that follow the casters' own edges, at any size of the map.
// After Kenzel 2013 [EDSM], which keeps a distance a texel; here a texel names its nearest edges, which are then evaluated
// exactly. See edge_rule.glsl.
#extension GL_GOOGLE_include_directive : require
#include "map_receiver.glsl"
#include "edge_rule.glsl"
#include "pixel_steps.glsl"

layout(constant_id = 2) const int KERNEL = 0; // of soft borders: box, smoothstep, disc
layout(constant_id = 3) const bool VIEWED = false;

layout(binding = 8) writeonly uniform image2D decisions;

layout(push_constant, scalar) uniform Push {
  float depth_bias; // fraction of a texel's slope, along both axes, that counts as on the receiver
  float slack;      // texels of depth a texel of distance that a curved receiver may lie before its plane
  float radius;     // texels around an edge that know of it
  float border;     // half width of soft borders, texels; 0: hard
} push;

// Share of a disc light that a straight edge leaves visible; x = distance over half width, positive in shadow.
float softened(float x) {
  x = clamp(x, -1.0, 1.0);
  if (KERNEL == 0) return 0.5 - 0.5 * x;
  if (KERNEL == 1) return 1.0 - smoothstep(-1.0, 1.0, x);
  return (acos(x) - x * sqrt(1.0 - x * x)) / 3.14159265358979;
}

bool visibilityAt(ivec2 pixel, out float v) {
  MapReceiver m;
  float how = -1.0;
  bool decided = mapReceiver(receiverAt(pixel), 0.0, 0.0, m, v);
  if (!decided) {
    ivec2 map_size = ivec2(view.map_size);
    EdgePoint p;
    p.texels = m.uv * vec2(map_size);
    p.depth = m.depth;
    p.plane = m.plane / vec2(map_size);
    p.tolerance = DEPTH_ULPS + push.depth_bias * (abs(p.plane.x) + abs(p.plane.y));
    p.slack = push.slack * m.texel_depth;
    Anchors a = anchorsOf(p, map_size);
    v = a.lit.x ? 1.0 : 0.0;
    decided = STEP != LISTED && isUnanimous(a) && (MIXED_ONLY || !anyEdge(a, map_size));
    if (!decided && STEP == LIST) return false;
    if (!decided) {
      float border;
      bool lit = litByEdges(p, a, map_size, push.radius, border, how);
      v = lit ? 1.0 : 0.0;
      if (push.border > 0.0) v = softened(border / push.border);
    }
  }
  if (VIEWED) imageStore(decisions, pixel, vec4((how + 1.0) / 3.0));
  return true;
}
