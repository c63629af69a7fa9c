#version 460
// Percentage-closer filtering of revectorized visibility; see lib/rpcf.glsl.
//
// With QUADS, a tile is decided whole if the depth bounds of the map's blocks say that all its kernels are lit or in shadow.
// Each thread of the next dispatch takes 2 x 2 pixels of a tile that is left. Bounds of the receivers' planes tell for every
// texel whether all four pixels find the same test. If they do, the runs are followed once for all of them. Pixels of the
// other quads are listed and worked on one by one. The image is the same.
// Without QUADS, a pixel whose kernel and ring lie on one side of the shadow is decided by their tests.
#extension GL_GOOGLE_include_directive : require
layout(constant_id = 1) const int MAX_DISTANCE = 16;
#define MAXDIST MAX_DISTANCE
layout(constant_id = 2) const int WIDTH = 7; // odd
layout(constant_id = 3) const int FUNCTION = 0; // as rpcfSum numbers them
layout(constant_id = 5) const bool QUADS = false; // for widths up to 25, and not for FUNCTION 2
#define OWN_TESTS
#include "common/receiver.glsl"
#include "common/rbsm_receiver.glsl"
#include "common/pixel_steps.glsl"
#include "lib/rbsm_profile.glsl"
#include "lib/rbsm_star.glsl"

const bool BY_QUADS = QUADS && STEP == LIST;
const int PIXELS = BY_QUADS ? 4 : 1;
// The kernels of a quad whose pixels lie more than 5 texels apart do not fit.
const int WINDOW_MOST = BY_QUADS ? WIDTH + 5 : WIDTH;
#define RPCF_WIDTH WIDTH
#define RPCF_PIXELS PIXELS
#include "lib/texel_window.glsl"
#include "lib/rpcf.glsl"
#include "common/soft_receiver.glsl"
#include "lib/pcf.glsl"
#include "common/pcf_bounds.glsl"
#include "common/hsm.glsl"
#include "common/quad_classes.glsl"
#include "common/tile_classes.glsl"

layout(binding = 6) uniform sampler2D blocks; // depth_bounds.comp; read if STEP is TILES

// Bounds of the depths to which the pixels of a quad compare a texel, relative to the plane of one of them, the base.
struct QuadPlanes {
  vec2 least_away, most_away; // places of the pixels' texels from the base's
  vec2 least_turn, most_turn; // differences of their slopes from the base's
  vec2 apart;                 // least and largest depth of their planes over the base's, at the base's texel
  vec2 slack;                 // least and largest slack
};

QuadPlanes quad_planes;
bool is_split; // whether some texel's test differs from pixel to pixel, as far as the bounds tell

// Adds the plane of a pixel.
void addPlane(inout QuadPlanes planes, ShadowPoint base, ShadowPoint p) {
  vec2 away = vec2(p.origin - base.origin), turn = p.dz - base.dz;
  float depth = p.z - dot(away, p.dz) - base.z;
  planes.least_away = min(planes.least_away, away);
  planes.most_away = max(planes.most_away, away);
  planes.least_turn = min(planes.least_turn, turn);
  planes.most_turn = max(planes.most_turn, turn);
  planes.apart = vec2(min(planes.apart.x, depth), max(planes.apart.y, depth));
  planes.slack = vec2(min(planes.slack.x, p.slack), max(planes.slack.y, p.slack));
}

// Least and largest change of the depths along an axis, at two neighbouring texels `away` from the base's.
void changeAlong(int axis, ShadowPoint base, vec2 away, out vec2 least, out vec2 largest) {
  QuadPlanes b = quad_planes;
  vec2 nearest = max(max(b.least_away[axis] - away, away - b.most_away[axis]), 0.0);
  vec2 farthest = max(b.most_away[axis] - away, away - b.least_away[axis]);
  vec2 one = away * b.least_turn[axis], other = away * b.most_turn[axis], plane = away * base.dz[axis];
  vec2 rounding = 5e-7 * abs(plane) + 5e-7;
  least = plane + min(one, other) - b.slack.y * farthest - rounding;
  largest = plane + max(one, other) - b.slack.x * nearest + rounding;
}

// Tests of 2 x 2 texels that hold for all pixels of the quad with the base `p`; sets is_split if there are none.
uint quadTests2x2(ShadowPoint p, ivec2 corner) {
  // Rounding cannot select other texels at the common corner of the four. Gather order:
  // (0, 1), (1, 1), (1, 0), (0, 0).
  vec4 stored = textureGather(shadow_map, vec3(vec2(corner + 1) / vec2(view.map_size), 0.0));
  vec2 away = vec2(corner - p.origin), least_x, largest_x, least_y, largest_y;
  changeAlong(0, p, vec2(away.x, away.x + 1.0), least_x, largest_x);
  changeAlong(1, p, vec2(away.y, away.y + 1.0), least_y, largest_y);
  vec4 lowest = p.z + quad_planes.apart.x + least_x.xyyx + least_y.yyxx;
  vec4 highest = p.z + quad_planes.apart.y + largest_x.xyyx + largest_y.yyxx;
  vec4 lit = step(min(highest, vec4(1.0)), stored), shadowed = vec4(greaterThan(min(lowest, vec4(1.0)), stored));
  is_split = is_split || any(equal(lit + shadowed, vec4(0.0)));
  return uint(lit.w) | uint(lit.z) << 1 | uint(lit.x) << 2 | uint(lit.y) << 3;
}

uint shadowTest2x2(ShadowPoint p, ivec2 corner) {
  return BY_QUADS ? quadTests2x2(p, corner) : receiverTests2x2(p, corner);
}

// Tests whether all texels of the kernel and its ring agree, and those of one more row and column, which make the size
// even.
bool isUniform(ShadowPoint p, out float v) {
  ivec2 first = p.texel - WIDTH / 2 - 1;
  uint all_ones = 15u, any_ones = 0u;
  for (int j = 0; j < WIDTH + 2; j += 2) {
    for (int i = 0; i < WIDTH + 2; i += 2) {
      uint tests = shadowTest2x2(p, first + ivec2(i, j));
      all_ones &= tests;
      any_ones |= tests;
    }
  }
  v = any_ones == 0u ? 0.0 : 1.0;
  return any_ones == 0u || all_ones == 15u;
}

// Stores the tests of the kernel and its ring.
void testKernel(ShadowPoint p) {
  ivec2 first = p.texel - WIDTH / 2 - 1;
  clearWindow();
  [[dont_unroll]] for (int j = 0; j < WIDTH + 2; j += 2) {
    // Bit i is the ring's column i. Column 32, the last one of the widest kernel's ring, is kept apart.
    uint upper = 0u, lower = 0u, last = 0u;
    [[dont_unroll]] for (int i = 0; i < WIDTH + 2; i += 2) {
      uint tests = shadowTest2x2(p, first + ivec2(i, j));
      upper |= i < 32 ? (tests & 3u) << i : 0u;
      lower |= i < 32 ? tests >> 2 << i : 0u;
      last = tests;
    }
    // The ring's last column is the left one of its two texels, because the width with the ring is odd.
    setWindowRow(j - 1, ivec2(WIDTH), upper >> 1 & lineBits(WIDTH), bitAt(upper, 0), bitAt(last, 0));
    setWindowRow(j, ivec2(WIDTH), lower >> 1 & lineBits(WIDTH), bitAt(lower, 0), bitAt(last, 2));
  }
}

// Finds the visibility of a pixel. Returns false if the pixel is left for the dispatch over the list.
bool visibilityAt(ivec2 pixel, out float v) {
  ShadowPoint p;
  if (rbsmReceiver(pixel, p, v)) return true;
  if (STEP != LISTED && isUniform(p, v)) return true;
  if (STEP == LIST) return false;
  testKernel(p);
  v = rpcfMean(p, FUNCTION);
  return true;
}

// Appends pixels of a quad to the list, one bit each.
void listPixels(ivec2 corner, uint pixels) {
  [[dont_unroll]] for (; pixels != 0u; pixels &= pixels - 1u) {
    uint index = atomicAdd(list.count, 1), groups = index / 64 + 1;
    list.pixels[index] = packTile(uvec2(quadPixel(corner, findLSB(pixels))));
    if (index % 64 == 0) {
      atomicAdd(list.tiles, 1); // tiles that the pixels fill
      atomicMax(list.groups[0], min(groups, MAX_TILE_GROUPS));
    }
  }
}

// Writes the pixels of a quad, or lists them if their tests differ. All of this is without branches around long work: a CPU
// driver executes both sides of a branch, but leaves a loop that no thread needs.
void workOnQuad(ivec2 corner) {
  uint open_pixels = 0u;
  ShadowPoint base = ShadowPoint(ivec2(0), vec2(0.5), ivec2(0), 0.0, vec2(0.0), 0.0);
  ivec2 texel[PIXELS], first = ivec2(0x10000), last = ivec2(-0x10000);
  [[unroll]] for (int i = 0; i < PIXELS; ++i) {
    ivec2 pixel = quadPixel(corner, i);
    texel[i] = ivec2(0);
    rpcf_fraction[i] = vec2(0.5);
    ShadowPoint p;
    float v;
    if (any(greaterThanEqual(pixel, ivec2(view.size)))) continue;
    if (rbsmReceiver(pixel, p, v)) {
      imageStore(visibility, pixel, vec4(v));
      continue;
    }
    if (open_pixels == 0u) {
      base = p;
      base.slack = 0.0;
      quad_planes = QuadPlanes(vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0), vec2(p.slack));
    }
    addPlane(quad_planes, base, p);
    texel[i] = p.texel;
    rpcf_fraction[i] = p.fraction;
    first = min(first, p.texel - WIDTH / 2);
    last = max(last, p.texel + WIDTH / 2);
    open_pixels |= 1u << i;
  }
  [[unroll]] for (int i = 0; i < PIXELS; ++i) {
    uvec2 kernel = (open_pixels >> i & 1u) != 0u ? uvec2(texel[i] - WIDTH / 2 - first) : uvec2(0u);
    rpcf_kernel[i] = kernel.x & 0xffffu | kernel.y << 16;
  }
  ivec2 size = last - first + 1;
  is_split = any(greaterThan(size, ivec2(WINDOW_MOST)));
  if (open_pixels == 0u || is_split) size = ivec2(0);
  testWindow(base, first, size);
  // The window has a discontinuity. Without one, its first test decides.
  bool discontinuous = false;
  [[dont_unroll]] for (int j = 0; j < size.y; ++j) discontinuous = discontinuous || edgeBits(windowRow(j), j, size) != 0u;
  if (is_split) size = ivec2(0);
  rpcfSum(base, first, discontinuous ? size : ivec2(0), FUNCTION);
  bool lit = !discontinuous && bitAt(window_rows[0], 0);
  [[unroll]] for (int i = 0; i < PIXELS; ++i) {
    float v = discontinuous ? rpcfMeanOf(i) : lit ? 1.0 : 0.0;
    if (!is_split && (open_pixels >> i & 1u) != 0u) imageStore(visibility, quadPixel(corner, i), vec4(v));
  }
  listPixels(corner, is_split ? open_pixels : 0u);
}

void main() {
  float v;
  if (readsList()) {
    for (uint i = firstListed(); i < list.count; i += listStride()) {
      ivec2 pixel = unpackTile(list.pixels[i]);
      visibilityAt(pixel, v);
      imageStore(visibility, pixel, vec4(v));
    }
    return;
  }
  if (STEP == TILES) {
    ivec2 corner = 8 * ivec2(gl_GlobalInvocationID.xy);
    int found = classifyKernels(blocks, corner, push.normal_offset, push.depth_bias, FIXED ? 0.0 : push.slack, FIXED, float(WIDTH / 2 + 2));
    storeTile(visibility, corner, found);
    listTile(corner, found);
    return;
  }
  if (BY_QUADS) {
    for (uint first_tile = firstOpenTile(); first_tile < open_tiles.count; first_tile += openTileStride()) {
      workOnQuad(quadCorner(first_tile));
    }
    return;
  }
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  bool inside = all(lessThan(pixel, ivec2(view.size)));
  bool decided = inside && visibilityAt(pixel, v);
  if (decided) imageStore(visibility, pixel, vec4(v));
  listPixel(pixel, inside && !decided);
}
