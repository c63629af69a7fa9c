// The edge profile, this project's own revectorization. Each side of a texel whose neighbour differs belongs to a run.
// The run has a height over the side, and fragments below that height take the other visibility. The profile covers
// every shape of edge: Z steps, U ends, gaps and bars; corners keep the shadow test. Include like lib/rbsm.glsl.
//
// Heights are in texels into the fragment's texel, along a run of L texels, at u in [0, L]:
//   Z: the ends turn different ways. The height is the line between the middles of the steps at both ends.
//   U: the ends turn the same way. The height is a parabola through both, as high as for a disc with such a run.
//   Corners, whose crossing edge is two texels or longer, stay as they are.
// Qualities: RUN_ONLY looks at the run alone. NEIGHBOURS also follows the adjacent runs, which tilt a Z and determine
// the height of a U. LINE also fits a line to the edge at both ends of a short Z.
#ifndef EDGESHADE_RBSM_PROFILE
#define EDGESHADE_RBSM_PROFILE
#include "lib/rbsm.glsl"

// A unit piece of the boundary: a texel inside, and the direction out of it.
struct Crack {
  ivec2 texel;
  ivec2 across;
};

struct FittedLine {
  ivec2 origin; // places are relative to the centre of this texel
  vec2 normal;  // unit length, from inside to outside
  float offset; // dot product of the normal with places on the line
};

const int FITTED_CRACKS = 8;    // number walked on either side of the first
const float LEAST_ACROSS = 0.3; // a line with a smaller component across a side has no useful height over it

// Moves on to the next crack. Returns false where four texels meet like a chess board, so that there are two ways on.
bool nextCrack(ShadowPoint p, float s, inout Crack crack, inout ivec2 along) {
  ivec2 ahead = crack.texel + along, beyond = ahead + crack.across;
  bool ahead_inside = shadowTest(p, ahead) == s, beyond_inside = shadowTest(p, beyond) == s;
  ivec2 across = crack.across;
  if (ahead_inside && beyond_inside) {
    crack = Crack(beyond, -along);
    along = across;
  } else if (ahead_inside) {
    crack.texel = ahead;
  } else if (!beyond_inside) {
    crack.across = along;
    along = -across;
  }
  return ahead_inside || !beyond_inside;
}

// Fits a least-squares line to the middles of the cracks around `first`, then moves it into the middle of the gap
// between the centres of inside and outside texels. Returns false if the boundary cannot be followed far enough, or if
// no line separates the centres.
bool fittedLine(ShadowPoint p, float s, Crack first, out FittedLine line) {
  line = FittedLine(first.texel, vec2(0.0), 0.0);
  Crack cracks[2 * FITTED_CRACKS + 1];
  cracks[0] = first;
  int count = 1;
  for (int side = -1; side <= 1; side += 2) {
    Crack crack = first;
    ivec2 along = side * abs(first.across.yx);
    for (int i = 0; i < FITTED_CRACKS; ++i) {
      if (!nextCrack(p, s, crack, along)) return false;
      cracks[count++] = crack;
    }
  }
  // Sums of halves are exact.
  vec2 sum = vec2(0.0), outwards = vec2(0.0);
  for (int i = 0; i < count; ++i) {
    sum += vec2(cracks[i].texel - line.origin) + 0.5 * vec2(cracks[i].across);
    outwards += vec2(cracks[i].across);
  }
  vec2 mean = sum / float(count);
  precise float difference = 0.0, twice_product = 0.0;
  for (int i = 0; i < count; ++i) {
    vec2 m = vec2(cracks[i].texel - line.origin) + 0.5 * vec2(cracks[i].across) - mean;
    difference += m.x * m.x - m.y * m.y;
    twice_product += 2.0 * m.x * m.y;
  }
  // Principal axis of the middles.
  float r = length(vec2(difference, twice_product));
  vec2 axis = difference >= 0.0 ? vec2(r + difference, twice_product) : vec2(twice_product, r - difference);
  axis = r > 0.0 ? normalize(axis) : vec2(1.0, 0.0);
  line.normal = vec2(-axis.y, axis.x);
  if (dot(line.normal, outwards) < 0.0) line.normal = -line.normal;
  float inside = -1e9, outside = 1e9;
  for (int i = 0; i < count; ++i) {
    vec2 at = vec2(cracks[i].texel - line.origin);
    inside = max(inside, dot(line.normal, at));
    outside = min(outside, dot(line.normal, at + vec2(cracks[i].across)));
  }
  line.offset = 0.5 * (inside + outside);
  return inside < outside;
}

// Height of the line over a crack, measured into the crack's texel, `distance` texels from the texel's centre in
// direction `along`. Returns false if the line is too steep there.
bool heightOver(FittedLine line, Crack crack, float distance, ivec2 along, out float height) {
  float across = dot(line.normal, vec2(crack.across));
  vec2 at = vec2(crack.texel - line.origin) + 0.5 * vec2(crack.across) + distance * vec2(along);
  height = (dot(line.normal, at) - line.offset) / across;
  return abs(across) > LEAST_ACROSS;
}

const int RUN_ONLY = 0, NEIGHBOURS = 1, LINE = 2;

// End of a run: the boundary turns away from the fragment's texel, turns towards it, or crosses another boundary;
// END_UNKNOWN if the run reaches MAXDIST.
const int END_AWAY = -1, END_UNKNOWN = 0, END_TOWARD = 1, END_SADDLE = 2;

const float FLAT_RUN = 6.0;            // U runs at least this long and big at both ends are the ends of boxes
const float TILT = 0.33;               // how strongly adjacent runs tilt a Z
const float BOW_FROM_NEIGHBOURS = 0.7; // how strongly adjacent runs determine the height of a U
const float LINE_RUN = 2.0;            // Z runs up to this length get fitted lines

// Counts the texels of a run beyond `texel` in direction `along`; `turn` tells how it ends. Texels of test `s` are
// inside; `across` points outwards.
int followRun(ShadowPoint p, float s, ivec2 texel, ivec2 along, ivec2 across, out int turn) {
  turn = END_UNKNOWN;
  RunTests r = runTests(along, across);
  for (int i = 0; i < MAXDIST; i += 2) {
    texel += along;
    bvec4 differs = runDiffers(p, r, texel, s);
    int more = differs.x || !differs.z ? 0 : i + 1 < MAXDIST && (differs.y || !differs.w) ? 1 : 2;
    if (more < 2) {
      bool inside = more == 0 ? !differs.x : !differs.y, outside = more == 0 ? differs.z : differs.w;
      turn = inside ? END_AWAY : outside ? END_TOWARD : END_SADDLE;
      return i + more;
    }
    texel += along;
  }
  return MAXDIST;
}

struct RunEnd {
  int texels; // beyond the fragment's own texel
  int turn;
  bool big;   // the crossing edge is at least two texels long
};

RunEnd runEnd(ShadowPoint p, float s, ivec2 along, ivec2 across) {
  RunEnd end;
  end.texels = followRun(p, s, p.texel, along, across, end.turn);
  end.big = false;
  ivec2 last = p.texel + end.texels * along;
  if (end.turn == END_TOWARD) {
    end.big = shadowTest(p, last - across) == s && shadowTest(p, last + along - across) != s;
  } else if (end.turn == END_AWAY) {
    end.big = shadowTest(p, last + 2 * across) != s && shadowTest(p, last + along + 2 * across) == s;
  }
  return end;
}

// The adjacent run beyond an end.
struct NextDoor {
  float texels; // 0: there is none, or the boundary turns back
  int turn;
};

NextDoor nextDoor(ShadowPoint p, float s, ivec2 along, ivec2 across, RunEnd end, int turn) {
  NextDoor next = NextDoor(0.0, END_UNKNOWN);
  if (end.big || abs(turn) != 1) return next;
  ivec2 first = p.texel + (end.texels + 1) * along - turn * across;
  if (shadowTest(p, first) != s || shadowTest(p, first + across) == s) return next;
  next.texels = 1.0 + float(followRun(p, s, first, along, across, next.turn));
  return next;
}

// Height of a line fitted to the edge around an end of the fragment's run. Returns false if there is none.
bool lineAtEnd(ShadowPoint p, float s, ivec2 along, ivec2 across, RunEnd end, out float height) {
  height = 0.0;
  ivec2 last = p.texel + end.texels * along;
  // The edge that crosses the run there.
  Crack crack;
  if (end.turn == END_TOWARD) crack = Crack(last, along);
  else if (end.turn == END_AWAY) crack = Crack(last + along + across, -along);
  else return false;
  FittedLine line;
  if (!fittedLine(p, s, crack, line)) return false;
  // The crossing edge is half a texel beyond the last texel's centre.
  return heightOver(line, Crack(p.texel, across), float(end.texels) + 0.5, along, height);
}

// A run, and the terms of its height.
struct Profile {
  float before;   // texels before the fragment's texel
  float texels;   // length of the run
  vec2 heights;   // at u = 0 and at u = texels
  float bow;      // height in the middle, above the line between both ends
  int fade;       // -1: heights.x fades to 0 within MAXDIST; 1: heights.y does; 0: neither
};

Profile edgeProfile(ShadowPoint p, float s, ivec2 across, int quality) {
  ivec2 along = abs(across.yx);
  RunEnd a = runEnd(p, s, -along, across), b = runEnd(p, s, along, across);
  Profile f = Profile(float(a.texels), float(a.texels + b.texels + 1), vec2(0.0), 0.0, 0);
  if (a.turn == END_SADDLE && b.turn == END_SADDLE) return f;
  // The boundary is assumed to continue at a saddle as at the other end.
  int A = a.turn == END_SADDLE ? -b.turn : a.turn, B = b.turn == END_SADDLE ? -a.turn : b.turn;
  if (A == 0 || B == 0) {
    if (A == 0 && B != 0 && !b.big) f.heights.y = 0.5 * float(B), f.fade = 1;
    if (B == 0 && A != 0 && !a.big) f.heights.x = 0.5 * float(A), f.fade = -1;
    return f;
  }
  float L = f.texels;
  bool is_u = A == B, any_big = a.big || b.big, all_big = a.big && b.big;
  if (is_u && L >= FLAT_RUN && all_big) return f;
  if (quality >= NEIGHBOURS && !is_u && L == 1.0 && any_big) return f;
  f.heights = 0.5 * vec2(float(A), float(B));

  NextDoor na = NextDoor(0.0, 0), nb = na;
  if (quality >= NEIGHBOURS) {
    na = nextDoor(p, s, -along, across, a, A);
    nb = nextDoor(p, s, along, across, b, B);
  }
  bool a_turns_on = na.texels > 0.0 && na.turn == A, b_turns_on = nb.texels > 0.0 && nb.turn == B;
  if (is_u) {
    precise float peak = 0.25 - 0.5 / L;
    if (a_turns_on && b_turns_on) {
      float ratio = 1.0 + (na.texels + nb.texels) / L;
      float circle = clamp(1.0 / (ratio * ratio - 1.0) - 0.5, -0.5, 0.5);
      peak += BOW_FROM_NEIGHBOURS * (circle - peak);
    }
    f.bow = -float(A) * (0.5 + peak);
    return f;
  }
  vec2 base = f.heights;
  if (a_turns_on && abs(na.texels - L) <= 1.0) f.heights.x += float(A) * TILT * 2.0 * (L - na.texels) / (L + na.texels);
  if (b_turns_on && abs(nb.texels - L) <= 1.0) f.heights.y += float(B) * TILT * 2.0 * (L - nb.texels) / (L + nb.texels);
  if (quality == LINE && L <= LINE_RUN) {
    float h;
    if (lineAtEnd(p, s, -along, across, a, h)) f.heights.x = clamp(h, base.x - 0.5, base.x + 0.5);
    if (lineAtEnd(p, s, along, across, b, h)) f.heights.y = clamp(h, base.y - 0.5, base.y + 0.5);
  }
  return f;
}

// Height of the boundary over the side; `place` is the fragment's position along the run within its texel.
float profileHeight(Profile f, float place) {
  precise float u = f.before + place;
  if (f.fade < 0) return f.heights.x * max(0.0, 1.0 - u / float(MAXDIST));
  if (f.fade > 0) return f.heights.y * max(0.0, 1.0 - (f.texels - u) / float(MAXDIST));
  float w = 1.0 - 2.0 * u / f.texels;
  precise float h = f.heights.x + (f.heights.y - f.heights.x) * (u / f.texels) + f.bow * (1.0 - w * w);
  return h;
}

// Change of that height a texel along the run.
float profileSlope(Profile f, float place) {
  float u = f.before + place, run = float(MAXDIST);
  if (f.fade < 0) return u < run ? -f.heights.x / run : 0.0;
  if (f.fade > 0) return f.texels - u < run ? f.heights.y / run : 0.0;
  return (f.heights.y - f.heights.x + 4.0 * f.bow * (1.0 - 2.0 * u / f.texels)) / f.texels;
}

// Sides over which the fragment may lie below the height: left, right, +v, -v.
bvec4 sidesInReach(ShadowPoint p, vec3 d, int quality) {
  bvec4 sides = discontinuitySides(d);
  // Only the better qualities raise a height above half a texel.
  if (quality != RUN_ONLY) return sides;
  vec2 c = p.fraction;
  return bvec4(sides.x && c.x < 0.5, sides.y && c.x > 0.5, sides.z && c.y > 0.5, sides.w && c.y < 0.5);
}

// Visibility of a fragment at an edge, on either side of it.
float revectorizeProfile(ShadowPoint p, vec3 d, int quality) {
  float s = 1.0 - d.z;
  bvec4 sides = sidesInReach(p, d, quality);
  vec4 from_side = vec4(p.fraction.x, 1.0 - p.fraction.x, 1.0 - p.fraction.y, p.fraction.y);
  // One loop for all sides: separate code for each would be four times as long.
  for (int k = 0; k < 4; ++k) {
    if (!sides[k]) continue;
    float place = k < 2 ? p.fraction.y : p.fraction.x;
    if (from_side[k] < profileHeight(edgeProfile(p, s, SIDES[k], quality), place)) return d.z;
  }
  return s;
}

// The same with a ramp of `width` texels, above 0 to 1, across the boundary. The distance to the boundary is measured
// along its normal, to first order. Only fragments of texels at an edge have one. The farthest of them lie half a texel
// from the boundary, so a wider ramp would end in a step.
float filterProfile(ShadowPoint p, vec3 d, int quality, float width) {
  bvec4 sides = discontinuitySides(d);
  vec4 from_side = vec4(p.fraction.x, 1.0 - p.fraction.x, 1.0 - p.fraction.y, p.fraction.y);
  precise float inside = 1.0;
  for (int k = 0; k < 4; ++k) {
    if (!sides[k]) continue;
    float place = k < 2 ? p.fraction.y : p.fraction.x;
    Profile f = edgeProfile(p, 1.0 - d.z, SIDES[k], quality);
    float slope = profileSlope(f, place);
    float distance = (from_side[k] - profileHeight(f, place)) / sqrt(1.0 + slope * slope);
    inside = min(inside, 0.5 + distance / width);
  }
  inside = max(inside, 0.0);
  return d.z > 0.0 ? 1.0 - inside : inside;
}

float RBSMProfile(ShadowPoint p, int quality) {
  float s = shadowTest(p, p.texel);
  vec3 d = computeDiscontinuity(p, s);
  return d.x > 0.0 || d.y > 0.0 ? revectorizeProfile(p, d, quality) : s;
}

#endif
