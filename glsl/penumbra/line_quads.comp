#version 460
// Finds the distance of every pixel of the listed blocks to the nearest line of an edge, and turns it into an intensity
// (Macedo, Apolinario (2018), eq. 8). A thread works on a quad of 2 x 2 pixels: it reads their depths, labels and hard
// shadows once, and measures each candidate for all four.
#extension GL_GOOGLE_include_directive : require
#include "common/receiver.glsl"
#include "edge_seeds.glsl"
#include "nearest_edge.glsl"
#include "nearest_line.glsl"
#include "beyond_edge.glsl"

layout(constant_id = 1) const bool ASIDE = false;    // consider labels aside too, past what stands in front
layout(constant_id = 2) const bool VIEWED = false;   // write seeds, labels and distances as well
layout(constant_id = 6) const bool TURNED = false;   // work on the quads that the other passes have left
layout(constant_id = 7) const bool FILTERED = false; // write intensities for a filter; false: write the visibility
layout(constant_id = 9) const int LINE_TAPS = 0;     // if SOFT: taps across the penumbra, see beyond_edge.glsl

layout(local_size_x = 64) in;

layout(binding = 4) uniform usampler2D labels;       // of the distance transform
layout(binding = 5) uniform usampler2D block_labels; // of line_blocks.comp
// Blocks, or if TURNED quads.
layout(binding = 6, scalar) readonly buffer List {
  uint groups[3];
  uint count;
  uint places[];
} list;
layout(binding = 8) writeonly uniform image2D intensity;
layout(binding = 10) writeonly uniform image2D distances;
layout(binding = 11) writeonly uniform uimage2D nearest_labels;
layout(binding = 12) writeonly uniform image2D seed_mask;  // 1 at a seed; the value of `widths` if SOFT
layout(binding = 14) writeonly uniform image2D pixel_widths; // if SOFT and FILTERED or VIEWED: full penumbra width in reach, world units
layout(binding = 15) writeonly uniform image2D visibility; // unless FILTERED; may be `hard`, of which a quad reads its own

// Quads for which an edge counts only if the surface bends evenly on the way to it.
layout(binding = 16, scalar) buffer TurnedList {
  uint turned_groups[3];
  uint turned_count;
  uint turned_quads[];
};

const uint OUT_OF_REACH = 0x8000u; // bit of a listed block's x

const ivec2 CORNERS[4] = ivec2[](ivec2(0, 1), ivec2(1, 1), ivec2(1, 0), ivec2(0, 0)); // in gather order

struct Quad {
  ivec2 pixel;
  Receiver corners[4];
  float width; // of a pixel, world units: the smallest of the four
  // Nearest line on a pixel's surface, and the nearest where the normal has turned by more than at a crease.
  Nearest level[4];
  Nearest turned[4];
  float beyond[4]; // of the latter only those farther than this count, squared
  bool off;        // some candidate lies on another surface
};

// The light at the quad's pixels, as in Place; set only if ALONG_LIGHT. These are no members of Quad, since AMD's compiler
// puts larger structs into memory.
vec3 rays[4], axis, side_x, side_y;

void considerForAll(uint candidate, inout Quad q) {
  bool is_label = candidate != NO_SEED;
  ivec2 pixel = is_label ? ivec2(candidate & 0xffffu, candidate >> 16) : ivec2(0);
  Seed seed = unpackSeed(pixel, seedAt(pixel));
  float half_length = halfLine(seed), tolerance = 2.0 * push.tolerance * q.width;
  vec2 width = widthOf(pixel);
  for (int k = 0; k < 4; ++k) {
    Receiver p = q.corners[k];
    Place at = Place(q.pixel + CORNERS[k], p, q.width, -1.0, axis, rays[k], side_x, side_y);
    vec3 apart = seed.point - p.position;
    float squared = lineDistanceSquared(at, toLine(apart, seed.along, half_length), width);
    bool on_surface, turned = false;
    if (PLANES) {
      // This is onSurface with one width for all four pixels.
      vec2 between = vec2(pixel - q.pixel - CORNERS[k]);
      float off = abs(dot(p.normal + seed.normal, apart)), most = tolerance * sqrt(max(dot(between, between), 1.0));
      float cosine = dot(p.normal, seed.normal);
      turned = cosine < CREASE_COSINE;
      on_surface = cosine > FARTHEST_COSINE && off <= (turned ? CURVED * most : most);
    } else {
      on_surface = sameDepth(p.position.z, seed.point.z, push.tolerance);
    }
    q.off = q.off || (is_label && !on_surface);
    bool good = is_label && on_surface;
    if (good && !turned && squared < q.level[k].squared) q.level[k] = Nearest(squared, candidate);
    if (good && turned && squared < q.turned[k].squared && squared > q.beyond[k]) q.turned[k] = Nearest(squared, candidate);
  }
}

// Considers the labels of the blocks around, those of the pixels, and where edges lie on several surfaces those aside;
// then the seeds next to the one found.
void search(inout Quad q) {
  ivec2 blocks = blockCount(BLOCK), corner = clamp((q.pixel + BLOCK / 2) / BLOCK, ivec2(0), blocks);
  uvec4 around = textureGather(block_labels, vec2(corner) / vec2(blocks));
  uvec4 own = textureGather(labels, vec2(q.pixel + 1) / vec2(view.size));
  for (int k = 0; k < 4; ++k) {
    ivec2 block = corner - 1 + CORNERS[k];
    bool inside = all(greaterThanEqual(block, ivec2(0))) && all(lessThan(block, blocks));
    considerForAll(inside ? around[k] : NO_SEED, q);
  }
  for (int k = 0; k < 4; ++k) {
    bool inside = all(lessThan(q.pixel + CORNERS[k], ivec2(view.size)));
    considerForAll(inside ? own[k] : NO_SEED, q);
  }
  int away = pixelsAside(q.width);
  int more = ASIDE && q.off ? 8 : 0;
  for (int i = 0; i < more; ++i) {
    int distance = i < 4 ? away : 5, side = (i & 1) == 0 ? -distance : distance;
    ivec2 place = q.pixel + ((i & 2) == 0 ? ivec2(side, 0) : ivec2(0, side));
    ivec2 inside = clamp(place, ivec2(0), ivec2(view.size) - 1);
    considerForAll(place == inside ? texelFetch(labels, inside, 0).x : NO_SEED, q);
  }
  // The seed nearest in the image need not be the nearest in the world: considers the labels around the seed found, near
  // and far.
  for (int step = 8; step > 0; step /= 2) {
    Nearest nearest = nothing();
    for (int k = 0; k < 4; ++k) {
      if (q.level[k].squared < nearest.squared) nearest = q.level[k];
    }
    bool found = nearest.label != NO_SEED;
    ivec2 seed = found ? ivec2(nearest.label & 0xffffu, nearest.label >> 16) : ivec2(0);
    for (int i = 0; i < 8; ++i) {
      // Skips the middle point, which is known.
      int j = i + int(i > 3), row = int(j > 2) + int(j > 5);
      ivec2 beside = seed + step * (ivec2(j - 3 * row, row) - 1);
      uint label = texelFetch(labels, clamp(beside, ivec2(0), ivec2(view.size) - 1), 0).x;
      considerForAll(found ? label : NO_SEED, q);
    }
  }
}

// Largest number of further searches.
const int ROUNDS = 3;

// A quad's place in units of quads; OUT_OF_REACH if no edge reaches its block.
void workOn(uint place) {
  bool in_reach = (place & OUT_OF_REACH) == 0;
  ivec2 pixel = QUAD * unpackTile(place & ~OUT_OF_REACH);
  if (any(greaterThanEqual(pixel, ivec2(view.size)))) return;
  vec2 size = vec2(view.size), middle = vec2(pixel + 1) / size;
  vec4 depths = textureGather(camera_depth, middle);
  Quad q;
  q.pixel = pixel;
  q.width = 3.0e38;
  q.off = false;
  for (int k = 0; k < 4; ++k) {
    Receiver r;
    ivec2 corner = min(pixel + CORNERS[k], ivec2(view.size) - 1);
    r.surface = depths[k] != view.far_depth;
    r.position = viewPosition(corner, depths[k]);
    r.normal = normalAt(corner, r.position);
    if (r.surface) q.width = min(q.width, pixelWidth(r.position));
    q.corners[k] = r;
    Place at = placeAt(corner, r);
    rays[k] = at.ray;
    // These are the same for all pixels.
    axis = at.axis;
    side_x = at.side_x;
    side_y = at.side_y;
    q.level[k] = nothing();
    q.turned[k] = nothing();
    q.beyond[k] = -1.0;
  }
  bool open = in_reach || !(FILTERED || VIEWED);
  for (int round = 0; open; ++round) {
    search(q);
    open = false;
    for (int k = 0; k < 4; ++k) {
      bool turned = q.corners[k].surface && q.turned[k].squared < q.level[k].squared;
      if (!TURNED) {
        open = open || turned;
        continue;
      }
      bool even = true;
      for (int once = 0; turned && once < 1; ++once) even = bendsEvenly(placeAt(pixel + CORNERS[k], q.corners[k]), q.turned[k]);
      if (even) continue;
      // A crease lies on the way to the edge: the search is repeated for edges that are farther.
      q.beyond[k] = q.turned[k].squared;
      q.turned[k] = nothing();
      open = true;
    }
    if (!TURNED && open) {
      uint index = atomicAdd(turned_count, 1);
      atomicMax(turned_groups[0], min(index / 64 + 1, MAX_TILE_GROUPS));
      turned_quads[index] = place;
      return;
    }
    open = open && round < ROUNDS;
  }
  vec4 hards = textureGather(hard, middle);
  for (int k = 0; k < 4; ++k) {
    ivec2 at = pixel + CORNERS[k];
    Receiver p = q.corners[k];
    Nearest nearest = q.level[k];
    if (q.turned[k].squared < nearest.squared) nearest = q.turned[k];
    if (any(greaterThanEqual(at, ivec2(view.size)))) continue;
    bool near = in_reach && p.surface && nearest.squared <= reachSquared(1.0);
    float D = sqrt(nearest.squared);
    float v = near ? penumbraIntensity(hards[k], D, push.penumbra) : hards[k] - 2.0;
    ivec2 seed_pixel = near ? ivec2(nearest.label & 0xffffu, nearest.label >> 16) : ivec2(0);
    if (SOFT && LINE_TAPS > 0) {
      bool wanted_line = near && D > 0.0;
      Seed seed = unpackSeed(seed_pixel, seedAt(seed_pixel));
      vec3 apart = toLine(seed.point - p.position, seed.along, halfLine(seed));
      float beyond = beyondEdge(at, p, apart, D, hards[k], wanted_line ? LINE_TAPS : 0);
      if (wanted_line) v = clamp(v + beyond, 0.0, 1.0);
    }
    if (SOFT && (FILTERED || VIEWED) && (near || VIEWED)) imageStore(pixel_widths, at, vec4(near ? widthOf(seed_pixel).x : 0.0));
    if (FILTERED || VIEWED) imageStore(intensity, at, vec4(v, packNormal(p.normal), 0.0, 0.0));
    if (!FILTERED && near) imageStore(visibility, at, vec4(v));
    if (VIEWED) {
      imageStore(distances, at, vec4(near ? D : uintBitsToFloat(0x7f800000u)));
      // The distance transform labels a seed with itself.
      bool is_seed = texelFetch(labels, at, 0).x == (uint(at.x) | uint(at.y) << 16);
      vec4 seen = SOFT ? vec4(widthOf(at), 0.0, 0.0) : vec4(1.0);
      imageStore(seed_mask, at, is_seed ? seen : vec4(0.0));
      imageStore(nearest_labels, at, uvec4(near ? nearest.label : NO_SEED));
    }
  }
}

void main() {
  uint threads = 64 * gl_NumWorkGroups.x, total = (TURNED ? 1 : 4) * list.count;
  for (uint i = gl_GlobalInvocationID.x; i < total; i += threads) {
    if (TURNED) {
      workOn(list.places[i]);
      continue;
    }
    uint block = list.places[i / 4];
    ivec2 quad = 2 * unpackTile(block & ~OUT_OF_REACH) + ivec2(i & 1, i >> 1 & 1);
    workOn(packTile(uvec2(quad)) | block & OUT_OF_REACH);
  }
}
