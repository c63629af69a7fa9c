// The light's view as a grid of square cells, and the space in which receivers and casters meet: a place `ndc` in
// [-1, 1]^2 and a depth that is affine in it on every plane. The depth is -1/w for a spot, w being the distance along
// the light's axis, and the map's depth for a sun; both grow away from the light.
//
// An area light is the square [-1, 1]^2, or the unit disc for a sun. A receiver p sees a point e of a caster on the
// light at s = (e.ndc - p.ndc) / (kappa (p.depth - e.depth)).
#ifndef EDGESHADE_GRID
#define EDGESHADE_GRID
#extension GL_EXT_scalar_block_layout : require

layout(push_constant, scalar) uniform Push {
  uint cells;      // along each side of the grid: a multiple of 64
  uint stride;     // floats from one vertex to the next
  uint chunks;     // workgroups of casters
  uint pairs;      // largest number of pairs of a caster and a block, on each level
  uint entries;    // largest number of entries of all lists
  uint spot;       // 1: the light has a position
  float nearest;   // smallest w that is kept
  float mirrored;  // -1 if the light's projection mirrors its image
  vec2 kappa;      // half-width of the light's image: ndc per unit of depth
  float normal_offset; // of tests in the shadow map: multiples of the offset that a plane needs
  uint silhouettes; // records of silhouette edges; those of the sides of faces follow
  uint faces;       // largest number of faces whose planes cut the light
  float far_vertices; // distance of casters' vertices from the origin of their own space, if they all lie far from it
} push;

// Blocks on level l have 4^l cells along each side; level 0 is the cells themselves.
const int LEVELS = 4;

uint levelSide(int level) { return push.cells >> (2 * level); }

// Index of the first block of a level in the array of depths.
uint levelStart(int level) {
  uint n = push.cells * push.cells;
  return level == 0 ? 0 : level == 1 ? n : level == 2 ? n + n / 16 : n + n / 16 + n / 256;
}

// Index in the array of depths of the greatest depth of all receivers.
uint greatestDepth() { return levelStart(3) + levelSide(3) * levelSide(3); }

// Maps floats to integers of the same order. 0 stands for "no receiver".
uint orderedBits(float f) {
  uint u = floatBitsToUint(f);
  return (u & 0x80000000u) != 0 ? ~u : u | 0x80000000u;
}

float orderedFloat(uint u) { return uintBitsToFloat((u & 0x80000000u) != 0 ? u & 0x7FFFFFFFu : ~u); }

// The cell of a place.
uint cellOf(vec2 ndc) {
  precise vec2 place = (0.5 * ndc + 0.5) * float(push.cells);
  uvec2 cell = min(uvec2(place), push.cells - 1);
  return cell.y * push.cells + cell.x;
}

// Stands in the list of receivers, which holds ndc and depth of each pixel, for pixels that need no list of casters.
const vec3 NO_RECEIVER = vec3(3.0e38);

// Header of the lists of one kind of caster.
struct ListHeader {
  uint groups3[3]; // dispatch arguments for the pairs of each level
  uint count3;
  uint groups2[3];
  uint count2;
  uint groups1[3];
  uint count1;
  uint total;      // entries that all lists need
  uint lost;       // pairs that found no room
  uint lost_blocks[8]; // bits of the blocks of 64 x 64 cells that they belong to, row by row
  uint longest;    // entries of the longest list
};

// An entry of a cell's list: the caster's number, and bounds of the receivers that the caster may matter to.
struct ListEntry {
  uint caster;
  uint bounds; // a range of places, and the upper half of the least depth's ordered bits
};

// Steps of the places in bounds, along each side of a cell.
const float BOUND_STEPS = 16.0;

// Bounds of the receivers in a cell that lie between two places, in cells from the cell's corner, and not nearer to the
// light than `nearest`. A fiftieth of a cell covers the rounding of places.
uint packBounds(vec2 low, vec2 high, float nearest) {
  uvec2 first = uvec2(clamp(floor((low - 0.02) * BOUND_STEPS), 0.0, BOUND_STEPS - 1.0));
  uvec2 last = uvec2(clamp(floor((high + 0.02) * BOUND_STEPS), 0.0, BOUND_STEPS - 1.0));
  return orderedBits(nearest) >> 16 << 16 | first.x | first.y << 4 | last.x << 8 | last.y << 12;
}

// A receiver in the form that bounds are compared with.
uvec3 boundedPlace(vec2 ndc, float depth) {
  precise vec2 place = (0.5 * ndc + 0.5) * float(push.cells);
  vec2 corner = min(floor(place), float(push.cells - 1));
  return uvec3(min((place - corner) * BOUND_STEPS, BOUND_STEPS - 1.0), orderedBits(depth) >> 16);
}

// Tests whether a receiver lies within bounds.
bool isBounded(uvec3 place, uint bounds) {
  return all(bvec4(place.x >= (bounds & 15u), place.y >= (bounds >> 4 & 15u), place.x <= (bounds >> 8 & 15u),
                   place.y <= (bounds >> 12 & 15u))) && place.z >= bounds >> 16;
}

// Index of a cell's block of 64 x 64 cells, row by row.
uint coarseBlock(uvec2 cell) { return (cell.y >> 6) * (push.cells >> 6) + (cell.x >> 6); }

#endif
