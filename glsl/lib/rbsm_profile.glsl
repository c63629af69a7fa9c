// The edge profile: each side of a texel whose neighbour differs has a run, the run a height over the side, and the
// fragments below that height take the other visibility. This project's own; it handles every shape of edge (Z steps,
// U ends, corners, gaps, bars) with fetches along at most two runs a fragment. Include as lib/rbsm.glsl.
//
// Heights are in texels, at most 0.5, along a run of L texels at u in [0, L]:
//   Z, the ends turn different ways: the line between the middles of the steps at both ends.
//   U, they turn the same way: a parabola through both, its peak as high as the area of a disc of that chord would say.
//   Corners, whose crossing edge is two texels or longer, stay.
#ifndef EDGESHADE_RBSM_PROFILE
#define EDGESHADE_RBSM_PROFILE
#include "lib/rbsm.glsl"

// How a run ends: the boundary turns away from the fragment's texel, towards it, or crosses another; or MAXDIST is reached.
const int END_AWAY = -1, END_UNKNOWN = 0, END_TOWARD = 1, END_SADDLE = 2;

struct RunEnd {
  int texels; // from the fragment's texel, not counting it
  int turn;
  bool big;   // the crossing edge is at least two texels long
};

// Follows the side `across` of the fragment's texel in direction `along`.
RunEnd followRun(ShadowPoint p, float s, ivec2 along, ivec2 across) {
  RunEnd end = RunEnd(MAXDIST, END_UNKNOWN, false);
  for (int i = 1; i <= MAXDIST; ++i) {
    ivec2 texel = p.texel + i * along;
    bool inside = shadowTest(p, texel) == s, outside = shadowTest(p, texel + across) != s;
    if (inside && outside) continue;
    end.texels = i - 1;
    if (inside) {
      end.turn = END_AWAY;
      end.big = shadowTest(p, texel - along + 2 * across) != s && shadowTest(p, texel + 2 * across) == s;
    } else if (outside) {
      end.turn = END_TOWARD;
      end.big = shadowTest(p, texel - along - across) == s && shadowTest(p, texel - across) != s;
    } else {
      end.turn = END_SADDLE;
    }
    break;
  }
  return end;
}

// A run with what its height is made of.
struct Profile {
  float before;       // texels before the fragment's
  float length_;      // texels in all
  float from, to;     // height at u = 0 and at u = length_
  float bulge;        // height in the middle, over the line between both
  int fade;           // -1: falls off from `from` within MAXDIST, 1: from `to`, 0: neither
};

Profile runProfile(RunEnd a, RunEnd b) {
  Profile f = Profile(float(a.texels), float(a.texels + b.texels + 1), 0.0, 0.0, 0.0, 0);
  // At a saddle the boundary is taken to go on as at the other end.
  int A = a.turn == END_SADDLE ? -b.turn : a.turn, B = b.turn == END_SADDLE ? -a.turn : b.turn;
  if (a.turn == END_SADDLE && b.turn == END_SADDLE || A == 0 && B == 0) return f;
  if (A == 0) {
    if (!b.big) f.to = 0.5 * float(B), f.fade = 1;
  } else if (B == 0) {
    if (!a.big) f.from = 0.5 * float(A), f.fade = -1;
  } else if (A != B) {
    f.from = 0.5 * float(A);
    f.to = 0.5 * float(B);
  } else if (f.length_ < 6.0 || !a.big || !b.big) {
    f.from = f.to = 0.5 * float(A);
    f.bulge = -float(A) * (0.75 - 0.5 / f.length_);
  }
  return f;
}

// Height of the boundary over the side, towards the fragment; `place` is the fragment's along the run in its texel.
float profileHeight(Profile f, float place) {
  float u = f.before + place;
  if (f.fade < 0) return f.from * max(0.0, 1.0 - u / float(MAXDIST));
  if (f.fade > 0) return f.to * max(0.0, 1.0 - (f.length_ - u) / float(MAXDIST));
  float w = 1.0 - 2.0 * u / f.length_;
  precise float h = f.from + (f.to - f.from) * (u / f.length_) + f.bulge * (1.0 - w * w);
  return h;
}

// Whether the fragment lies between the side `across` and the boundary over it; v is its distance from the side.
bool crossesProfile(ShadowPoint p, float s, ivec2 across, float v, int quality) {
  ivec2 along = abs(across.yx);
  float place = across.x != 0 ? p.fraction.y : p.fraction.x;
  return v < profileHeight(runProfile(followRun(p, s, -along, across), followRun(p, s, along, across)), place);
}

// No height exceeds half a texel: of two opposite sides only the nearer can be crossed.
ivec2 nearSides(ShadowPoint p) { return mix(ivec2(-1), ivec2(1), greaterThanEqual(p.fraction, vec2(0.5))); }

// Whether there is a discontinuity on the nearer side of each axis.
bvec2 nearDiscontinuities(ShadowPoint p, vec3 d) {
  bvec4 sides = discontinuitySides(d);
  ivec2 near = nearSides(p);
  return bvec2(near.x < 0 ? sides.x : sides.y, near.y < 0 ? sides.w : sides.z);
}

bool nearSideDiffers(ShadowPoint p, vec3 d) { return any(nearDiscontinuities(p, d)); }

// The visibility of a fragment at an edge, on either side of it.
float revectorizeProfile(ShadowPoint p, vec3 d, int quality) {
  float s = 1.0 - d.z;
  ivec2 near = nearSides(p);
  bvec2 differs = nearDiscontinuities(p, d);
  vec2 v = min(p.fraction, 1.0 - p.fraction);
  bool flips = differs.x && crossesProfile(p, s, ivec2(near.x, 0), v.x, quality);
  flips = flips || differs.y && crossesProfile(p, s, ivec2(0, near.y), v.y, quality);
  return flips ? d.z : s;
}

float RBSMProfile(ShadowPoint p, int quality) {
  float s = shadowTest(p, p.texel);
  vec3 d = computeDiscontinuity(p, s);
  return d.x > 0.0 || d.y > 0.0 ? revectorizeProfile(p, d, quality) : s;
}

#endif
