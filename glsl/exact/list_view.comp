#version 460
// Pictures of what the lists of a pixel's cell hold.
#extension GL_GOOGLE_include_directive : require
#include "grid.glsl"
#include "grid_layers.glsl"

layout(constant_id = 0) const bool EDGES = false; // there are lists of edges

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0, scalar) readonly buffer Receivers { vec3 receivers[]; };
layout(binding = 1) writeonly uniform image2D layers;   // triangles between the receiver and the light's centre
layout(binding = 2) writeonly uniform image2D edges;    // edges in the cell's list
layout(binding = 3) writeonly uniform image2D cells;    // a shade of grey for each cell, 0 without a receiver
layout(binding = 4) writeonly uniform image2D fallback; // 1: the cell's casters found no room
layout(binding = 10, scalar) readonly buffer EdgeHeader { ListHeader edge_header; };
layout(binding = 11, scalar) readonly buffer EdgeStarts { uint edge_starts[]; };

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), size = imageSize(layers);
  if (any(greaterThanEqual(pixel, size))) return;
  vec3 r = receivers[uint(pixel.y * size.x + pixel.x)];
  vec4 shown = vec4(0.0); // layers, edges, cell, fallback
  if (r != NO_RECEIVER) {
    uint cell = cellOf(r.xy), edge_count = 0;
    bool room = hasTriangles(cell);
    if (EDGES) {
      edge_count = edge_starts[cell + 1] - edge_starts[cell];
      room = room && edge_starts[cell + 1] <= push.entries && (edge_header.lost == 0 || !isLost(edge_header.lost_blocks, cell));
    }
    // Neighbours mostly differ (Knuth's multiplicative hash).
    float grey = 0.25 + 0.75 * float((cell * 2654435761u) >> 24) / 255.0;
    shown = vec4(room ? float(layersOver(r, cell, true)) : 0.0, room ? float(edge_count) : 0.0, grey, room ? 0.0 : 1.0);
  }
  imageStore(layers, pixel, vec4(shown.x));
  if (EDGES) imageStore(edges, pixel, vec4(shown.y));
  imageStore(cells, pixel, vec4(shown.z));
  imageStore(fallback, pixel, vec4(shown.w));
}
