// Common part of the passes of the exact Euclidean distance transform: constants, push constants, and the comparison of
// two seeds.
//
// Seeds come as a vertical bit mask with one word per column and block of 32 rows: bit y % 32 of word x + width * (y /
// 32). A label is x | y << 16 of a seed, or NO_SEED. Among several nearest seeds, the one with the smallest y is
// chosen, then the one with the smallest x. Sides are at most 65535 pixels; all arithmetic is in 32 bits.
#ifndef EDGESHADE_EDT
#define EDGESHADE_EDT
#extension GL_EXT_scalar_block_layout : require

const uint NO_SEED = 0xffffffffu;
// A distance in rows that stands for no seed.
const uint FAR = 0xffffu;

layout(push_constant, scalar) uniform Push {
  uvec2 size;
  uint radius; // pixels; 65534 for an unbounded transform
  uint span;   // columns per segment, band or block of pixels; for edt_columns.comp blocks of rows
  uint bands;
  uint merge;  // bands on either side of a merge
  bool squared; // write squared distances as well
} push;

uvec2 seedOf(uint label) { return uvec2(label & 0xffffu, label >> 16); }

// Rows from row `i` of a block to the nearest seed of a column, negative upwards; beyond +-65534 if there is none.
// `column` holds the column's word of the block, then two distances of 16 bits each: from the block's first row up to
// the next seed above the block, and from its last row down to the next seed below it.
int columnOffset(uvec2 column, uint i) {
  uint above = column.x & (0xffffffffu >> (31 - i)), below = column.x >> i;
  int up = above != 0 ? int(i) - findMSB(above) : int(i + (column.y & 0xffffu));
  int down = below != 0 ? findLSB(below) : int(31 - i + (column.y >> 16));
  return up <= down ? -up : down;
}

// The first pixel of row y that is nearer to seed c than to seed b, where b lies further left; negative or beyond every
// image if there is no such pixel.
//
// c is nearer at x if and only if d (2x - b.x - c.x) > n with d = c.x - b.x and n = (c.y - y)^2 - (b.y - y)^2 (after
// Meijster, Roerdink, Hesselink 2000, solved for x). |n| < 2^32 is kept apart from its sign. A quotient of 2^18 or more
// lies beyond every image. Smaller quotients in floating point are off by at most 1; the remainder, exact modulo 2^32,
// corrects them.
int firstNearer(uint b, uint c, uint y) {
  uvec2 pb = seedOf(b), pc = seedOf(c);
  int gb = abs(int(pb.y) - int(y)), gc = abs(int(pc.y) - int(y));
  uint d = pc.x - pb.x;
  uint n = uint(abs(gc - gb)) * uint(gc + gb);
  float quotient = float(n) / float(d);
  int q = 0x3ffff;
  int rest = 1;
  if (quotient < 262143.0) {
    q = int(quotient);
    rest = int(n - uint(q) * d);
    if (rest < 0) {
      q--;
      rest += int(d);
    } else if (rest >= int(d)) {
      q++;
      rest -= int(d);
    }
  }
  // The largest m with d m <= n, or with d m < n where c wins ties because it lies further up.
  int m = gc >= gb ? q : rest == 0 ? -q : -q - 1;
  if (rest == 0 && pc.y < pb.y) m--;
  return (m + int(pb.x + pc.x) + 2) >> 1;
}

// True if pixel x of row y is nearer to seed c than to seed b, where b lies further left; see firstNearer. Neither
// product exceeds the square of a side, so they fit in 32 bits without their signs.
bool isNearer(uint b, uint c, uint x, uint y) {
  uvec2 pb = seedOf(b), pc = seedOf(c);
  int gb = abs(int(pb.y) - int(y)), gc = abs(int(pc.y) - int(y));
  int m = int(2 * x) - int(pb.x + pc.x);
  uint p = (pc.x - pb.x) * uint(abs(m)), n = uint(abs(gc - gb)) * uint(gc + gb);
  if (p == n && (p == 0 || (m > 0) == (gc > gb))) return pc.y < pb.y;
  return gc < gb ? m >= 0 || p < n : m > 0 && p > n;
}

// Squared distance from pixel p to a seed. Returns true if it is within the radius.
bool inReach(uint label, uvec2 p, out uint squared) {
  uvec2 d = uvec2(abs(ivec2(seedOf(label)) - ivec2(p)));
  squared = d.x * d.x + d.y * d.y;
  return label != NO_SEED && (push.radius >= FAR - 1 || max(d.x, d.y) <= push.radius && squared <= push.radius * push.radius);
}

#endif
