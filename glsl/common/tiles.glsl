// Lists of 8 x 8 pixel tiles, or of pixels: one pass writes a list, another works on it by indirect dispatch.
// Coordinates reach up to 65535 along each axis.
#ifndef EDGESHADE_TILES
#define EDGESHADE_TILES

// Number of workgroups that every device supports. Longer lists are worked on in a loop.
const uint MAX_TILE_GROUPS = 65535;

uint packTile(uvec2 tile) { return tile.x | tile.y << 16; }
ivec2 unpackTile(uint tile) { return ivec2(tile & 0xffffu, tile >> 16); }

#endif
