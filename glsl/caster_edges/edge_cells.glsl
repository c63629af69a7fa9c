// Where the cells of a map of edge ids (edge_map.glsl), and what has no slot in them, are kept.
#ifndef EDGESHADE_EDGE_CELLS
#define EDGESHADE_EDGE_CELLS

// Cell (i, j) has the texels (i - 1, j - 1) to (i, j) at its corners. Within half a texel of the map's rim there is none.
bool isCell(ivec2 cell, ivec2 map_size) {
  return all(greaterThan(cell, ivec2(0))) && all(lessThan(cell, map_size));
}

// Row by row, one fewer along each axis than the map has texels.
uint cellIndex(ivec2 cell, ivec2 map_size) { return uint(cell.y - 1) * uint(map_size.x - 1) + uint(cell.x - 1); }

// An edge beyond the K nearest of its cell.
struct SpilledEdge {
  uint segment;
  uint next; // entry, or all bits
};

// The first cell of the lower half, of a map in two buffers.
uint lowerCells(ivec2 map_size) { return uint(map_size.x - 1) * uint(map_size.y / 2); }

#endif
