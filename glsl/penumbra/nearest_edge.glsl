// Search for the nearest edge in the world. Candidates are labels of seeds; the nearest one on the pixel's own surface
// counts. If every seed has a penumbra width of its own (SOFT), distances are shares of that width. The edge in whose
// penumbra the pixel lies deepest then counts, and intensities are continuous where widths meet. The paper takes the
// edge at the smallest distance (MEET_NEAREST). Include after edge_seeds.glsl.
#ifndef EDGESHADE_NEAREST_EDGE
#define EDGESHADE_NEAREST_EDGE

// Sides of the square blocks of pixels that share one label, taken at the block's middle: coarse, then fine.
const int BLOCK = 4, QUAD = 2;

layout(constant_id = 3) const bool SOFT = false;
layout(constant_id = 4) const bool MEET_NEAREST = false;
layout(constant_id = 5) const bool ALONG_LIGHT = false; // measure distances along the light, on a plane parallel to the map

layout(constant_id = 8) const bool FILTER_IN_WORLD = false; // if SOFT: the filter's width is in world units, not a share

layout(binding = 3, scalar) readonly buffer Seeds { uvec3 seeds[]; };
layout(binding = 13) uniform sampler2D widths; // of seed_width.comp; read if SOFT

uvec3 seedAt(ivec2 pixel) { return seeds[seedIndex(pixel)]; }

struct Nearest {
  float squared; // distance, world units; a share of the seed's penumbra width if SOFT and not MEET_NEAREST
  uint label;    // x + 65536 y of the seed
};

// The place from which edges are searched.
struct Place {
  ivec2 pixel;
  Receiver p;
  float width;  // width of a pixel there, world units
  float beyond; // only edges farther than this count; squared as in Nearest
  // These are set only if ALONG_LIGHT:
  vec3 axis;    // axis of the light's view, pointing away from the light
  vec3 ray;     // along the light's ray, scaled to length 1 along the axis
  vec3 side_x, side_y; // unit vectors along the sides of the light's square, the map's axes
};

Place placeAt(ivec2 pixel, Receiver p) {
  Place at = Place(pixel, p, pixelWidth(p.position), -1.0, vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
  if (SOFT && ALONG_LIGHT) {
    mat4 m = view.light_clip_from_view[0];
    vec3 ray = -towardsLight(p.position, 0);
    vec3 axis = normalize(vec3(m[0][3], m[1][3], m[2][3]));
    at.axis = view.light_position_view[0].w == 0.0 ? ray : axis;
    // Beside and behind the light everything is lit; the limit only keeps the numbers finite.
    at.ray = ray / max(dot(ray, at.axis), 0.05);
    vec3 x = vec3(m[0][0], m[1][0], m[2][0]), y = vec3(m[0][1], m[1][1], m[2][1]);
    at.side_x = normalize(x - dot(x, at.axis) * at.axis);
    at.side_y = normalize(y - dot(y, at.axis) * at.axis);
  }
  return at;
}

// Weight of the Euclidean distance against the larger of the distances along both axes, if ALONG_LIGHT.
const float ROUNDED = 0.5;

// Squared distance to a point at the offset `apart`, as measured for a seed. A square light shines past an edge
// diagonal to its sides over a wider range than past an edge along a side. The ratio is that of the Euclidean distance
// to the larger of the distances along both axes. But with the larger distance alone, a stretch of an edge along an
// axis would be equally near everywhere, and where widths grow along the edge the widest would win. So the measure
// blends both distances; along the diagonal it finds 1.24 times the width, where 1.41 would be right. The result is at
// least `cosine` times the Euclidean distance, so that no edge reaches beyond the tiles marked for it.
float squaredDistance(Place at, vec3 apart, float cosine) {
  float squared = dot(apart, apart);
  if (!(SOFT && ALONG_LIGHT)) return squared;
  vec3 across = apart - dot(apart, at.axis) * at.ray;
  float larger = max(abs(dot(across, at.side_x)), abs(dot(across, at.side_y)));
  float rounded = (larger + ROUNDED * length(across)) / (1.0 + ROUNDED);
  return max(rounded * rounded, squared * (cosine * cosine));
}

// Width of the penumbra at a label's seed, where the filter's width is none of its shares.
float widthAt(uint label) {
  bool found = FILTER_IN_WORLD && label != NO_SEED;
  return found ? texelFetch(widths, ivec2(label & 0xffffu, label >> 16), 0).x : 1.0;
}

// Largest squared distance at which an edge counts whose penumbra is `width` wide in the world.
float reachSquared(float width) {
  float reach = 0.5 * (push.penumbra + filterShare(width, FILTER_IN_WORLD));
  return reach * reach * 1.000001;
}

// The same for blocks, which also need the reach of the filter. All tiles within this reach are listed, so no label
// leaves the listed tiles.
float blockReachSquared(float width) {
  float filter_share = filterShare(width, FILTER_IN_WORLD);
  float reach = 0.5 * (push.penumbra + filter_share) + 0.5 * filter_share;
  return reach * reach * 1.000001;
}

// Start of a search: any seed is nearer.
Nearest nothing() { return Nearest(3.0e38, NO_SEED); }

// Squared distance of the seed found, in the units of reachSquared.
float squaredShare(Nearest nearest) {
  if (!(SOFT && MEET_NEAREST)) return nearest.squared;
  bool found = nearest.label != NO_SEED;
  float width = texelFetch(widths, found ? ivec2(nearest.label & 0xffffu, nearest.label >> 16) : ivec2(0), 0).x;
  return found && width > 0.0 ? nearest.squared / (width * width) : 3.0e38;
}

// Tests whether a seed's point may lie on the place's surface, by both points alone. If the normal turns by more than
// at a crease, the surface must be curved in between, which bendsEvenly tests.
bool onSurface(Place at, vec3 apart, vec3 normal, ivec2 pixel) {
  if (!PLANES) return sameDepth(at.p.position.z, at.p.position.z + apart.z, push.tolerance);
  // The distance is at least one pixel: a pixel's own edge lies somewhere on the way to the next pixel.
  float pixels = max(length(vec2(pixel - at.pixel)), 1.0);
  bool turned = dot(at.p.normal, normal) < CREASE_COSINE;
  return onePatch(at.p.normal, normal, apart, pixels, at.width, turned ? CURVED * push.tolerance : push.tolerance);
}

// Tests whether the surface bends evenly between the place and the seed found, as curved surfaces do; at a crease the
// normal turns within a pixel. While the normals at both ends differ by more than the angle of a crease, the way is
// halved. Both halves must have a fair part of the turn; the half with the larger part is examined further. A middle
// point that lies on the surface of neither end stands in front, and proves nothing.
bool bendsEvenly(Place at, Nearest nearest) {
  bool found = nearest.label != NO_SEED;
  ivec2 a = at.pixel, b = found ? ivec2(nearest.label & 0xffffu, nearest.label >> 16) : ivec2(0);
  uvec3 seed = seedAt(b);
  vec3 from = at.p.position, n = at.p.normal, to = seedPoint(b, seed), m = seedNormal(seed);
  bool even = true, open = PLANES && found && dot(n, m) < CREASE_COSINE;
  while (open) {
    ivec2 between = abs(b - a), middle = (a + b) / 2;
    Receiver r = receiverAt(middle);
    float first = dot(n, r.normal), second = dot(r.normal, m);
    bool hidden = !onePatch(n, r.normal, r.position - from, max(length(vec2(middle - a)), 1.0), at.width, push.tolerance) &&
                  !onePatch(m, r.normal, r.position - to, max(length(vec2(middle - b)), 1.0), at.width, push.tolerance);
    bool smooth_halves = min(first, second) >= CREASE_COSINE;
    even = r.surface && (hidden || smooth_halves || turnsEvenly(first, second));
    open = even && !hidden && !smooth_halves && max(between.x, between.y) > 2;
    if (first < second) {
      b = middle;
      to = r.position;
      m = r.normal;
    } else {
      a = middle;
      from = r.position;
      n = r.normal;
    }
  }
  return even;
}

// Takes the candidate if it is nearer and lies on the place's surface. If `limited`, the place must also lie within the
// candidate's own reach.
void consider(uint candidate, Place at, bool limited, inout Nearest nearest) {
  ivec2 pixel = ivec2(candidate & 0xffffu, candidate >> 16);
  bool is_label = candidate != NO_SEED;
  if (!is_label) pixel = ivec2(0);
  uvec3 seed = seedAt(pixel);
  vec3 apart = seedPoint(pixel, seed) - at.p.position;
  vec2 width = SOFT ? texelFetch(widths, pixel, 0).xy : vec2(1.0);
  float d2 = squaredDistance(at, apart, width.y);
  if (SOFT) {
    float share = d2 / (width.x * width.x);
    if (!MEET_NEAREST) d2 = share;
    // A seed without a width has no penumbra, and its share would be 0/0.
    is_label = is_label && (MEET_NEAREST || FILTER_IN_WORLD ? !limited || share <= blockReachSquared(width.x) : width.x > 0.0);
  }
  bool nearer = is_label && d2 < nearest.squared && d2 > at.beyond && onSurface(at, apart, seedNormal(seed), pixel);
  nearest.squared = nearer ? d2 : nearest.squared;
  nearest.label = nearer ? candidate : nearest.label;
}

void consider(uint candidate, Place at, inout Nearest nearest) { consider(candidate, at, false, nearest); }

// Distance in pixels at which a pixel's own search looks aside: about the reach of the penumbra, to look past anything
// thinner. If every seed has a width of its own, it is the reach of usual penumbrae. A pixel is `width` wide.
int pixelsAside(float width) {
  float reach = SOFT ? 17.0 : penumbraReach() / width;
  return int(clamp(0.7 * reach, 1.0, 8192.0) + 0.5);
}

// Considers the labels of the four pixels `distance` away along both axes, past anything that stands in front. Repeats
// this in `rings` rings, each twice as far as the one before.
void considerAside(usampler2D labels, int distance, int rings, Place at, inout Nearest nearest) {
  for (int i = 0; i < 4 * rings; ++i) {
    int away = ((i & 1) == 0 ? -distance : distance) << (i >> 2);
    ivec2 aside = at.pixel + ((i & 2) == 0 ? ivec2(away, 0) : ivec2(0, away));
    ivec2 inside = clamp(aside, ivec2(0), ivec2(view.size) - 1);
    consider(aside == inside ? texelFetch(labels, inside, 0).x : NO_SEED, at, nearest);
  }
}

// Considers the seeds nearest in the image to eight points `step` pixels around the seed found: candidates along the
// edge.
void considerAround(usampler2D labels, int step, Place at, inout Nearest nearest) {
  bool found = nearest.label != NO_SEED;
  ivec2 seed = found ? ivec2(nearest.label & 0xffffu, nearest.label >> 16) : ivec2(0);
  for (int i = 0; i < 8; ++i) {
    // Skips the middle point, which is known.
    int j = i + int(i > 3), row = int(j > 2) + int(j > 5);
    ivec2 around = seed + step * (ivec2(j - 3 * row, row) - 1);
    uint label = texelFetch(labels, clamp(around, ivec2(0), ivec2(view.size) - 1), 0).x;
    consider(found ? label : NO_SEED, at, nearest);
  }
}

// Number of labels along both axes.
ivec2 blockCount(int side) { return (ivec2(view.size) + side - 1) / side; }
ivec2 blockPixel(ivec2 block, int side) { return min(side * block + side / 2, ivec2(view.size) - 1); }

uint blockLabel(usampler2D block_labels, ivec2 block, int side) {
  ivec2 inside = clamp(block, ivec2(0), blockCount(side) - 1);
  uint label = texelFetch(block_labels, inside, 0).x;
  return block == inside ? label : NO_SEED;
}

#endif
