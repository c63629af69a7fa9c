#version 460
// Renders the shadow map of alpha-tested casters: discards fragments below the alpha cutoff.
#extension GL_GOOGLE_include_directive : require
#include "material.glsl"

layout(location = 0) in vec2 fragment_uv;
layout(location = 1) in float fragment_alpha;

void main() {
  if (push.base_color.a * fragment_alpha * sampleBaseColor(fragment_uv).a < push.alpha_cutoff) discard;
}
