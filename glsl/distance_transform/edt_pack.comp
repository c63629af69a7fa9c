#version 460
// Seeds are the texels of a floating-point or normalised mask that are not 0.
#extension GL_GOOGLE_include_directive : require
#include "edt_pack.glsl"

layout(binding = 0) uniform sampler2D mask;

bool isSeed(ivec2 pixel) { return texelFetch(mask, pixel, 0).x != 0.0; }
