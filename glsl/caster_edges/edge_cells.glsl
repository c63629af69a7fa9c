// Layout of a map of edge ids (edge_map.glsl): indices of its cells, and entries for edges without a slot.
#ifndef EDGESHADE_EDGE_CELLS
#define EDGESHADE_EDGE_CELLS

// Cell (i, j) has the texels (i - 1, j - 1) to (i, j) at its corners. There are no cells within half a texel of the
// map's rim.
bool isCell(ivec2 cell, ivec2 map_size) {
  return all(greaterThan(cell, ivec2(0))) && all(lessThan(cell, map_size));
}

// Cells are stored row by row, one fewer along each axis than the map has texels.
uint cellIndex(ivec2 cell, ivec2 map_size) { return uint(cell.y - 1) * uint(map_size.x - 1) + uint(cell.x - 1); }

// An edge beyond the K nearest of its cell.
struct SpilledEdge {
  uint segment;
  uint next; // next entry of the cell, or all bits set
};

// The first cell of the lower half, if the map is split between two buffers.
uint lowerCells(ivec2 map_size) { return uint(map_size.x - 1) * uint(map_size.y / 2); }

#endif
