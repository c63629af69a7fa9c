#version 460
// Edge distance shadow maps with edge identities: hard shadows that follow the casters' own edges, at any size of the
// map. Kenzel (2013) [EDSM] keeps one distance per texel. Here a cell between texels names the edges that enter it, and
// these are evaluated exactly; see edge_rule.glsl.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "edge_rule.glsl"
#include "edsm_border.glsl"
#include "common/pixel_steps.glsl"

layout(constant_id = 2) const int KERNEL = 0; // of soft borders: box, smoothstep, disc
layout(constant_id = 3) const bool VIEWED = false;

layout(binding = 11) writeonly uniform image2D decisions;

layout(push_constant, scalar) uniform Push {
  float edge_bias;  // fraction of the plane's change of depth per texel within which an edge lies on the receiver
  float depth_bias; // fraction of the same that is subtracted from the receiver's depth at an anchor
  float slack;      // by how much a curved receiver may lie in front of its plane: texel depths per texel of distance
  float half_border; // of soft borders, texels; 0: hard
} push;

// Steepest slope, in texel depths per texel, at which an edge behind an anchor may still belong to the surface seen
// there.
const float STEEPEST = 4.0;

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
    float slope = abs(p.plane.x) + abs(p.plane.y);
    p.tolerance = DEPTH_ULPS + push.edge_bias * slope;
    p.bias = DEPTH_ULPS + push.depth_bias * slope;
    p.slack = push.slack * m.texel_depth;
    p.steepest = STEEPEST * m.texel_depth;
    Anchors a = anchorsOf(p, map_size);
    v = a.lit.x ? 1.0 : 0.0;
    decided = STEP != LISTED && isUnanimous(a) && (MIXED_ONLY || !anyEdge(a, map_size));
    if (!decided && STEP == LIST) return false;
    if (!decided) {
      float border;
      bool lit = litByEdges(p, a, map_size, border, how);
      v = lit ? 1.0 : 0.0;
      if (SOFT) v = borderVisibility(border / push.half_border, KERNEL);
    }
  }
  if (VIEWED) imageStore(decisions, pixel, vec4(how));
  return true;
}

void main() {
  float v;
  if (readsList()) {
    for (uint i = firstListed(); i < list.count; i += listStride()) {
      ivec2 pixel = unpackTile(list.pixels[i]);
      visibilityAt(pixel, v);
      imageStore(visibility, pixel, vec4(v));
    }
    return;
  }
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  bool inside = all(lessThan(pixel, ivec2(view.size)));
  bool decided = inside && visibilityAt(pixel, v);
  if (decided) imageStore(visibility, pixel, vec4(v));
  listPixel(pixel, inside && !decided);
}
