// The part of an area light that a receiver sees, from the edges that cross it: counters of layers at 16 x 16 samples,
// as bits. Each row is shifted by a sixteenth of a column against the row before, and the rows are tilted by a sixteenth
// the other way: a rotated grid, in which no two samples have the same place along either axis. Rows of a disc are as
// wide as the disc there and weigh as much. Binding-free.
//
// A counter holds the layers over the receiver towards a sample, less those towards the light's centre. An edge changes
// it if the path from the centre to the sample, up or down to the sample's row and then along it, crosses the edge.
#ifndef EDGESHADE_LIGHT_BITS
#define EDGESHADE_LIGHT_BITS

// Counters modulo 256. Word w holds row w in its lower and row w + 8 in its upper half; `low` has the words 0 to 3,
// `high` 4 to 7, and the index is the binary digit.
const int DIGITS = 8;
struct LightBits {
  uvec4 low[DIGITS];
  uvec4 high[DIGITS];
};

const float ROWS = 16.0;

// Turns a place on the light into the frame in which rows are level: a shear of the square, a rotation of the disc.
vec2 ontoRows(vec2 s, bool disc) {
  precise vec2 level = disc ? vec2(16.0 * s.x - s.y, 16.0 * s.y + s.x) / sqrt(257.0) : vec2(s.x, s.y + s.x / 16.0);
  return level;
}

// Turns the receiver's plane, 1 + dot(tilt, s) = 0, into the same frame.
vec2 tiltOntoRows(vec2 tilt, bool disc) {
  return disc ? ontoRows(tilt, true) : vec2(tilt.x - tilt.y / 16.0, tilt.y);
}

// Heights of four rows from `first` on, in [-1, 1].
vec4 rowHeights(float first) { return (2.0 * (first + vec4(0.0, 1.0, 2.0, 3.0)) + 1.0) / ROWS - 1.0; }

// Half-widths of the light at these heights.
vec4 rowWidths(vec4 heights, bool disc) { return disc ? sqrt(1.0 - heights * heights) : vec4(1.0); }

// Places of the first columns of four rows, in columns.
vec4 rowShifts(float first) { return (first + vec4(0.5, 1.5, 2.5, 3.5)) / ROWS; }

LightBits noLayers() {
  LightBits b;
  for (int k = 0; k < DIGITS; ++k) b.low[k] = b.high[k] = uvec4(0u);
  return b;
}

// Columns to the right of the places `x` in four rows, as 16 bits each. `x` is relative to the light's half-width.
uvec4 columnsRight(vec4 x, vec4 shifts) {
  ivec4 before = ivec4(clamp(floor(8.0 * (x + 1.0) - shifts) + 1.0, vec4(0.0), vec4(16.0)));
  return uvec4(0xFFFFu) << uvec4(before) & 0xFFFFu;
}

// An edge on the light: from a to b, with the occluder where cross2(b - a, p - a) > 0.
struct LightEdge {
  vec2 a, d; // start, and end minus start
  bool side; // the light's centre lies on the occluder's side
  bool straddles; // crosses the vertical line through the light's centre
};

// Finds how the edge changes the counters of four rows: `plus` and `minus` have 16 bits for each row.
void rowChanges(LightEdge e, float first, bool disc, out uvec4 plus, out uvec4 minus) {
  vec4 y = rowHeights(first), width = rowWidths(y, disc);
  vec4 up = y - e.a.y;
  bvec4 spans = notEqual(lessThanEqual(vec4(e.a.y), y), lessThanEqual(vec4(e.a.y + e.d.y), y));
  bvec4 side = greaterThan(e.d.x * up + e.d.y * e.a.x, vec4(0.0)); // of the place above or below the centre
  vec4 x = e.a.x + up * (e.d.x / (e.d.y == 0.0 ? 1.0 : e.d.y));
  uvec4 right = columnsRight(x / width, rowShifts(first));
  uvec4 inside = e.d.y < 0.0 ? right : right ^ 0xFFFFu;
  uvec4 covered = mix(mix(uvec4(0u), uvec4(0xFFFFu), side), inside, spans);
  bvec4 reference = e.straddles ? bvec4(e.side) : side;
  uvec4 changes = mix(uvec4(e.straddles ? 0xFFFFu : 0u), uvec4(0xFFFFu), spans);
  plus = mix(covered, uvec4(0u), reference) & changes;
  minus = mix(uvec4(0u), covered ^ 0xFFFFu, reference) & changes;
}

void addDigits(inout uvec4 digits[DIGITS], uvec4 plus, uvec4 minus) {
  for (int k = 0; k < DIGITS; ++k) {
    uvec4 carry = digits[k] & plus, borrow = ~digits[k] & minus;
    digits[k] ^= plus | minus;
    plus = carry;
    minus = borrow;
  }
}

// Counts an edge from a to b with `weight` layers on the occluder's side.
void addEdge(inout LightBits bits, vec2 a, vec2 b, int weight, bool disc) {
  LightEdge e;
  e.a = a;
  e.d = b - a;
  e.side = e.d.y * a.x - e.d.x * a.y > 0.0;
  e.straddles = (a.x <= 0.0) != (b.x <= 0.0);
  uvec4 plus_upper, minus_upper, plus, minus;
  rowChanges(e, 0.0, disc, plus, minus);
  rowChanges(e, 8.0, disc, plus_upper, minus_upper);
  plus |= plus_upper << 16;
  minus |= minus_upper << 16;
  for (int i = 0; i < weight; ++i) addDigits(bits.low, plus, minus);
  rowChanges(e, 4.0, disc, plus, minus);
  rowChanges(e, 12.0, disc, plus_upper, minus_upper);
  plus |= plus_upper << 16;
  minus |= minus_upper << 16;
  for (int i = 0; i < weight; ++i) addDigits(bits.high, plus, minus);
}

// Tests whether the light reaches below the receiver's plane, which lies where 1 + dot(tilt, s) = 0.
bool reachesBelow(vec2 tilt) { return abs(tilt.x) + abs(tilt.y) >= 1.0; }

// Samples above the receiver's plane: those with 1 + dot(tilt, s) > 0.
uvec4 rowsAbove(vec2 tilt, float first, bool disc) {
  vec4 y = rowHeights(first), width = rowWidths(y, disc);
  vec4 at_zero = 1.0 + tilt.y * y;
  uvec4 right = columnsRight(-at_zero / (tilt.x == 0.0 ? 1.0 : tilt.x) / width, rowShifts(first));
  return tilt.x > 0.0 ? right : tilt.x < 0.0 ? right ^ 0xFFFFu : mix(uvec4(0u), uvec4(0xFFFFu), greaterThan(at_zero, vec4(0.0)));
}

// Share of the light that no layer covers and that lies above the receiver's plane. `layers` lie over the receiver
// towards the light's centre.
float lightVisible(LightBits b, uint layers, vec2 tilt, bool disc) {
  uvec4 low = uvec4(0u), high = uvec4(0u);
  for (int k = 0; k < DIGITS; ++k) {
    // Digit of the value at which no layer is left.
    uint digit = (-layers >> k & 1u) != 0 ? 0xFFFFFFFFu : 0u;
    low |= b.low[k] ^ digit;
    high |= b.high[k] ^ digit;
  }
  low = ~low;
  high = ~high;
  if (reachesBelow(tilt)) {
    tilt = tiltOntoRows(tilt, disc);
    low &= rowsAbove(tilt, 0.0, disc) | rowsAbove(tilt, 8.0, disc) << 16;
    high &= rowsAbove(tilt, 4.0, disc) | rowsAbove(tilt, 12.0, disc) << 16;
  }
  vec4 widths[4] = vec4[](rowWidths(rowHeights(0.0), disc), rowWidths(rowHeights(4.0), disc),
                          rowWidths(rowHeights(8.0), disc), rowWidths(rowHeights(12.0), disc));
  vec4 ones = vec4(1.0);
  float seen = dot(vec4(bitCount(low & 0xFFFFu)), widths[0]) + dot(vec4(bitCount(high & 0xFFFFu)), widths[1]) +
               dot(vec4(bitCount(low >> 16)), widths[2]) + dot(vec4(bitCount(high >> 16)), widths[3]);
  return seen / (16.0 * dot(widths[0] + widths[1] + widths[2] + widths[3], ones));
}

#endif
