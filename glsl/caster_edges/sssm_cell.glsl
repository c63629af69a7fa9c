// Cells of a shadow silhouette map: Sen, Cammarano, Hanrahan, "Shadow Silhouette Maps" (2003). Cell (i, j) reaches from
// the centre of texel (i, j) of the shadow map to the centre of texel (i + 1, j + 1), so that each of its corners has a
// depth.
// Include after drawn_edge.glsl.
#ifndef EDGESHADE_SSSM_CELL
#define EDGESHADE_SSSM_CELL

// Value of a cell without an edge: its middle.
const uint CELL_MIDDLE = 0x80008000u;
// Bound of the keys. Of several edges in a cell the one with the smallest key stays; of equal ones, the first in the
// list.
const uint CELL_KEYS = 1u << 24;
// Points keep this distance from a cell's border, so that lines between points are never degenerate.
const float CELL_MARGIN = 1.0 / 64.0;

uint packCell(vec2 point) { return packUnorm2x16(point); }

// Finds the point that represents an edge in a cell, in the cell's own coordinates, and its key. Returns false if the
// edge misses the cell. The point is a vertex if one lies in the cell, so that corners stay corners; otherwise it is
// the middle of the edge's part in the cell. The paper takes crossings with the cell's diagonals. Keys order vertices
// first, then longer parts, then edges nearer to the light; the paper keeps the last one drawn.
bool cellPoint(EdgeSegment e, ivec2 cell, out vec2 point, out float t, out uint key) {
  precise vec2 a = (e.a - 0.5) - vec2(cell), b = (e.b - 0.5) - vec2(cell), along = b - a;
  precise float t0 = 0.0, t1 = 1.0;
  for (int i = 0; i < 2; ++i) {
    precise float u = (0.0 - a[i]) / along[i], v = (1.0 - a[i]) / along[i];
    bool level = along[i] == 0.0;
    if (level && (a[i] < 0.0 || a[i] >= 1.0)) t1 = -1.0;
    if (!level) {
      t0 = max(t0, min(u, v));
      t1 = min(t1, max(u, v));
    }
  }
  if (!(t0 < t1)) return false;
  bool has_a = (e.flags & SEGMENT_CUT_A) == 0 && all(greaterThanEqual(a, vec2(0.0))) && all(lessThan(a, vec2(1.0)));
  bool has_b = (e.flags & SEGMENT_CUT_B) == 0 && all(greaterThanEqual(b, vec2(0.0))) && all(lessThan(b, vec2(1.0)));
  t = has_a == has_b ? (has_a ? 0.5 : 0.5 * (t0 + t1)) : has_a ? 0.0 : 1.0;
  precise vec2 found = a + t * along;
  point = clamp(found, vec2(CELL_MARGIN), vec2(1.0 - CELL_MARGIN));
  precise float way = (t1 - t0) * length(along);
  uint order = uint(clamp(1.0 - way * 0.70710678, 0.0, 1.0) * 2047.0);
  uint depth = uint(clamp(segmentDepth(e, t), 0.0, 1.0) * 4095.0);
  key = (has_a || has_b ? 0u : 1u << 23) | order << 12 | depth;
  return true;
}

// The same; with KILL, only for edges that the light sees.
bool seenCellPoint(sampler2DArray shadow_map, ivec2 map_size, bool kill, EdgeSegment e, ivec2 cell, out vec2 point, out uint key) {
  float t;
  if (!cellPoint(e, cell, point, t, key)) return false;
  return !(kill && isHidden(shadow_map, map_size, e, vec2(cell) + 0.5 + point, segmentDepth(e, t)));
}

#endif
