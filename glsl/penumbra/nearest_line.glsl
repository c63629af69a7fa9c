// Distances to short lines: a seed stands for the stretch of the edge through its pixel, so that few seeds around a pixel
// tell its distance to the edge.
// Include after edge_seeds.glsl and nearest_edge.glsl.
#ifndef EDGESHADE_NEAREST_LINE
#define EDGESHADE_NEAREST_LINE

// Half of a line's length in the image, pixels.
const float HALF_LINE = 0.25;

// Largest distance in pixels of a seed's line, or of a block's pixel, from the pixel that stands for it. The tiles that
// edge_seeds.comp marks allow for both (AROUND_LINE).
const int LINE_PIXELS = 2, BLOCK_PIXELS = BLOCK / 2;

// Half of a line's length, world units. A view ray meets a line at an angle, so that a pixel covers more of it.
float halfLine(Seed seed) {
  vec3 from_eye = normalize(seed.point), ray = view.view_from_clip[2][3] == 0.0 ? vec3(0.0, 0.0, -1.0) : from_eye;
  float facing = dot(seed.along, ray);
  return HALF_LINE * pixelWidth(seed.point) * inversesqrt(max(1.0 - facing * facing, 0.01));
}

// Offset from a place to the closest point of a seed's line; `apart` leads from the place to the seed's point.
vec3 toLine(vec3 apart, vec3 along, float half_length) {
  return apart - clamp(dot(apart, along), -half_length, half_length) * along;
}

// Width of the seed's penumbra in the world and its cosine, as seed_width.comp stores them; 1 unless SOFT.
vec2 widthOf(ivec2 seed_pixel) { return SOFT ? texelFetch(widths, seed_pixel, 0).xy : vec2(1.0); }

// Largest distance in the world at which the seed's penumbra may change the image.
float worldReach(vec2 width) { return penumbraReach() * (width.x / width.y); }

// Squared distance to the closest point of a seed's line, in units of the penumbra's width if SOFT.
float lineDistanceSquared(Place at, vec3 closest, vec2 width) {
  float squared = squaredDistance(at, closest, width.y);
  return SOFT ? squared / (width.x * width.x) : squared;
}

// Tests whether a penumbra around the seed's line may reach a pixel of the block. All such blocks lie in the tiles that
// edge_seeds.comp or seed_width.comp marks for the seed.
bool mayReach(ivec2 seed_pixel, float depth, ivec2 pixel, float world_reach) {
  ivec2 apart = abs(seed_pixel - pixel);
  float reach = pixelReach(world_reach, depth, view.pixel_size, view.off_axis);
  return float(max(apart.x, apart.y)) <= reach + float(LINE_PIXELS + BLOCK_PIXELS);
}

#endif
