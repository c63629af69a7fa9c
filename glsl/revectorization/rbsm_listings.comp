#version 460
// Visibility by the papers' listings line by line: silhouette recovery, filtering and RBSM*; see lib/rbsm_listings.glsl.
// The receiver's depth at a texel is that of rbsm.comp, so that the images are equal.
#extension GL_GOOGLE_include_directive : require
layout(constant_id = 0) const bool FIXED = false; // the listings' fixed depth instead of the receiver's plane
layout(constant_id = 1) const int MAX_DISTANCE = 16;
#define MAXDIST MAX_DISTANCE
#include "common/receiver.glsl"
#include "lib/rbsm_listings.glsl"
#include "lib/shadow_test.glsl"

const int SILHOUETTE = 0, FILTERED = 1, STAR = 2;
layout(constant_id = 2) const int FUNCTION = SILHOUETTE;

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 3) uniform sampler2DArray shadow_map;
layout(binding = 4) writeonly uniform image2D visibility;

layout(push_constant, scalar) uniform Push {
  float normal_offset; // multiples of what a plane needs
  float depth_bias;    // fraction of the plane's change of depth per texel, over both axes
  float slack;         // by how much a curved receiver may lie in front of its plane: texel depths per texel of distance
} push;

// Change of the pixel's depth per texel, and the depth by which it may lie in front of its plane, per texel of distance.
vec2 dz;
float slack;

float shadowTest(vec3 p, ivec2 texel) {
  vec2 first = floor(p.xy), away = vec2(texel) - first;
  precise float at_centre = p.z + dot(dz, first + 0.5 - p.xy);
  precise float z = at_centre + (away.x * dz.x + away.y * dz.y) - (abs(away.x) + abs(away.y)) * slack;
  return shadowTest(z, shadowMapDepth(shadow_map, texel, 0, ivec2(view.map_size)));
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, ivec2(view.size)))) return;
  MapReceiver m;
  float v;
  if (!mapReceiver(receiverAt(pixel), push.normal_offset, push.depth_bias, m, v)) {
    vec2 map_size = vec2(view.map_size);
    dz = FIXED ? vec2(0.0) : m.plane / map_size;
    slack = FIXED ? 0.0 : push.slack * m.texel_depth;
    vec3 p = vec3(m.uv * map_size, m.depth);
    v = FUNCTION == STAR ? improvedRBSM(p) : RBSM(p, FUNCTION == SILHOUETTE);
  }
  imageStore(visibility, pixel, vec4(v));
}
