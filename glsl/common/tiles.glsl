// A list of 8 x 8 pixel tiles, or of pixels, made by one pass and worked off by another through indirect dispatch; places
// up to 65535 along each axis.
#ifndef EDGESHADE_TILES
#define EDGESHADE_TILES

// Limit of workgroups that every device grants; longer lists are worked off in a loop.
const uint MAX_TILE_GROUPS = 65535;

uint packTile(uvec2 tile) { return tile.x | tile.y << 16; }
ivec2 unpackTile(uint tile) { return ivec2(tile & 0xffffu, tile >> 16); }

#endif
