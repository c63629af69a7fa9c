#version 460
// Makes the points of a shadow silhouette map without rasterisation, by walking along each edge through all cells that
// it touches. KEYS finds the smallest key of each cell, WINNERS the first edge with that key, and POINTS writes its
// point. The map is the same as that of the raster path.
#extension GL_GOOGLE_include_directive : require
#include "casters.glsl"
#include "drawn_edge.glsl"
#include "sssm_cell.glsl"

const int KEYS = 0, WINNERS = 1, POINTS = 2;
layout(constant_id = 0) const int STEP = KEYS;
layout(constant_id = 1) const bool KILL = true; // leave out edges that the light does not see

layout(local_size_x = 64) in;

layout(binding = 0) uniform sampler2DArray shadow_map;
layout(binding = 1, scalar) readonly buffer Header { SilhouetteHeader header; };
layout(binding = 2, scalar) readonly buffer Segments { EdgeSegment segments[]; };
layout(binding = 3, scalar) buffer Keys { uint keys[]; };
layout(binding = 4, scalar) buffer Winners { uint winners[]; };
layout(binding = 5, r32ui) writeonly uniform uimage2D points;

// Number of columns up to which a thread walks an edge alone. The whole workgroup shares longer edges.
const int ALONE = 16;

shared uint long_edges[64];
shared uint long_count;

ivec2 map_size;

void consider(uint index, EdgeSegment e, ivec2 cell) {
  if (any(lessThan(cell, ivec2(0))) || any(greaterThanEqual(cell, map_size))) return;
  vec2 point;
  uint key;
  if (!seenCellPoint(shadow_map, map_size, KILL, e, cell, point, key)) return;
  uint at = cell.y * map_size.x + cell.x;
  if (STEP == KEYS) atomicMin(keys[at], key);
  else if (keys[at] == key) atomicMin(winners[at], index);
}

// The columns of cells that an edge touches, along its longer axis.
struct Walk {
  int axis;
  int begin, end; // range of columns
};

Walk walkOf(EdgeSegment e) {
  vec2 d = abs(e.b - e.a);
  Walk w;
  w.axis = d.x >= d.y ? 0 : 1;
  w.begin = max(int(floor(min(e.a[w.axis], e.b[w.axis]) - 0.5 - 1e-3)), 0);
  w.end = min(int(floor(max(e.a[w.axis], e.b[w.axis]) - 0.5 + 1e-3)) + 1, map_size[w.axis]);
  return w;
}

void walk(uint index, EdgeSegment e, Walk w, int first, int step) {
  int other = 1 - w.axis;
  vec2 a = e.a - 0.5, b = e.b - 0.5;
  float slope = (b[other] - a[other]) / (b[w.axis] - a[w.axis]);
  float low = min(a[other], b[other]), high = max(a[other], b[other]);
  for (int column = w.begin + first; column < w.end; column += step) {
    float y0 = clamp(a[other] + slope * (float(column) - a[w.axis]), low, high);
    float y1 = clamp(a[other] + slope * (float(column + 1) - a[w.axis]), low, high);
    // Slightly more than the edge covers; cellPoint decides exactly which cells it touches.
    int top = int(floor(min(y0, y1) - 2e-3)), bottom = int(floor(max(y0, y1) + 2e-3));
    for (int row = top; row <= bottom; ++row) consider(index, e, w.axis == 0 ? ivec2(column, row) : ivec2(row, column));
  }
}

void main() {
  if (STEP == POINTS) {
    map_size = imageSize(points);
    uint i = 64 * chunkIndex(gl_WorkGroupID) + gl_LocalInvocationIndex;
    if (i >= uint(map_size.x * map_size.y)) return;
    ivec2 cell = ivec2(i % map_size.x, i / map_size.x);
    uint value = CELL_MIDDLE, winner = winners[i], key;
    if (winner != 0xFFFFFFFFu) {
      vec2 point;
      float t;
      cellPoint(segments[winner], cell, point, t, key);
      value = packCell(point);
    }
    imageStore(points, cell, uvec4(value));
    return;
  }
  map_size = textureSize(shadow_map, 0).xy;
  if (gl_LocalInvocationIndex == 0) long_count = 0;
  barrier();
  uint i = 64 * chunkIndex(gl_WorkGroupID) + gl_LocalInvocationIndex;
  if (i < header.count) {
    EdgeSegment e = segments[i];
    if (isDrawn(e)) {
      Walk w = walkOf(e);
      if (w.end - w.begin <= ALONE) walk(i, e, w, 0, 1);
      else long_edges[atomicAdd(long_count, 1)] = i;
    }
  }
  barrier();
  // The order does not matter: the smallest key wins.
  for (uint k = 0; k < long_count; ++k) {
    EdgeSegment e = segments[long_edges[k]];
    walk(long_edges[k], e, walkOf(e), int(gl_LocalInvocationIndex), 64);
  }
}
