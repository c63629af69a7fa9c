// What the passes share that turn edges of hard shadows into penumbrae: seeds, push constants, tiles and their reach.
#ifndef EDGESHADE_EDGE_SEEDS
#define EDGESHADE_EDGE_SEEDS
#include "lib/penumbra.glsl"
#include "seed_format.glsl"
#include "common/tiles.glsl"

const int TILE = 8, TILE_PIXELS = TILE * TILE;
const uint NO_SEED = 0xffffffffu; // else x + 65536 y of a seed's pixel

layout(constant_id = 0) const bool PLANES = true; // tell surfaces apart by planes; false: by depth, as the paper

// Where every seed has a penumbra width of its own, that width is the unit of lengths: `penumbra` is 1.
layout(push_constant, scalar) uniform Push {
  float penumbra;      // full width, world units
  float filter_width;  // world units
  float tolerance;     // of the test for one surface: pixels a pixel, or a share of the depth
  int step;            // of nearest_block.comp, blocks
  float beta;          // of seed_width.comp: factor of the width
  float normal_offset; // of its blocker search: multiples of what a plane needs
  float depth_bias;    // of its blocker search: fraction of a texel's slope, along both axes
} push;

float eyeDepth(vec3 p) { return abs(p.z); }
float pixelWidth(vec3 p) { return view.pixel_size.x * eyeDepth(p) + view.pixel_size.y; }

// Within this distance of an edge the image may differ from hard shadows: half the penumbra, blurred by half the filter.
float penumbraReach() { return 0.5 * (push.penumbra + push.filter_width); }

// Tiles along both axes.
ivec2 tileCount() { return (ivec2(view.size) + TILE - 1) / TILE; }
int tileIndex(ivec2 tile) { return tile.y * tileCount().x + tile.x; }

// First and last tile with anything within `radius` of a point at eye depth `depth` that is seen in a pixel.
void tilesInReach(ivec2 pixel, float radius, float depth, out ivec2 first, out ivec2 last) {
  // A point of an edge lies up to a pixel off its own pixel's centre.
  int reach = int(ceil(pixelReach(radius, depth, view.pixel_size, view.off_axis))) + 2;
  first = max((pixel - reach) >> 3, 0);
  last = min((pixel + reach) >> 3, tileCount() - 1);
}

#endif
