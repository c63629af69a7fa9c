// Common part of the passes that turn edges of hard shadows into penumbrae: seeds, push constants, tiles and their
// reach.
// Include after common/receiver.glsl.
#ifndef EDGESHADE_EDGE_SEEDS
#define EDGESHADE_EDGE_SEEDS
#include "lib/penumbra.glsl"
#include "seed_format.glsl"
#include "common/tiles.glsl"

const int TILE = 8, TILE_PIXELS = TILE * TILE;
const uint NO_SEED = 0xffffffffu; // other labels are x + 65536 y of a seed's pixel

layout(constant_id = 0) const bool PLANES = true; // separate surfaces by planes; false: by depth, as in the paper

// If every seed has a penumbra width of its own, lengths are in units of that width, and `penumbra` is 1.
layout(push_constant, scalar) uniform Push {
  float penumbra;      // full width, world units
  float filter_width;  // world units, always so if the filter has one width for all
  float tolerance;     // of the test for one surface: pixels off the plane per pixel of distance, or a share of the depth
  int step;            // of nearest_block.comp, blocks
  float beta;          // of seed_width.comp: factor of the penumbra width
  float normal_offset; // of seed_width.comp's blocker search: multiples of the offset that a plane needs
  float depth_bias;    // of the same search: fraction of the plane's change of depth per texel, over both axes
} push;

float eyeDepth(vec3 p) { return abs(p.z); }
float pixelWidth(vec3 p) { return view.pixel_size.x * eyeDepth(p) + view.pixel_size.y; }

// Distance from an edge within which the image may differ from hard shadows: half the penumbra, widened by half the
// filter.
float penumbraReach() { return 0.5 * (push.penumbra + push.filter_width); }

// Width of the filter in the unit of an edge's distances: that edge's penumbra is `width` wide in the world.
float filterShare(float width, bool filter_in_world) {
  if (!filter_in_world) return push.filter_width;
  return width > 0.0 ? push.filter_width / width : 0.0;
}

// A block of pixels around one whose edge's line is in reach: 2 pixels from seed to line, 2 in the block, 1 for rounding.
const int AROUND_LINE = 5;

// Number of tiles along both axes.
ivec2 tileCount() { return (ivec2(view.size) + TILE - 1) / TILE; }
int tileIndex(ivec2 tile) { return tile.y * tileCount().x + tile.x; }

// First and last tile that may hold anything within `radius` of a point of an edge. The point has the eye depth `depth`
// and appears at most `around` pixels from the given one. Returns the largest distance in pixels.
int tilesInReach(ivec2 pixel, float radius, float depth, int around, out ivec2 first, out ivec2 last) {
  int reach = int(ceil(pixelReach(radius, depth, view.pixel_size, view.off_axis))) + around;
  first = max((pixel - reach) >> 3, 0);
  last = min((pixel + reach) >> 3, tileCount() - 1);
  return reach;
}

#endif
