// Lookup in a shadow silhouette map: the corner of a cell that a point belongs to.
#ifndef EDGESHADE_SSSM_QUADRANT
#define EDGESHADE_SSSM_QUADRANT
#include "lib/edge_segment.glsl"

// Corner, numbered as in shadowTest2x2, of the quadrant that q lies in. Four rays go from the cell's own point to the
// points of its neighbours left, top, right and bottom; in this order they turn to the same side. A quadrant of more
// than half a turn is everything that is not outside it. If the points lie so that the rays do not follow in this
// order, the quadrant whose middle direction is closest to q counts.
int quadrantOf(vec2 q, vec2 own, vec2 neighbours[4]) {
  const int corners[4] = int[](0, 1, 3, 2);
  precise vec2 away = q - own;
  int hits = 0, hit = 0, likely = 0;
  float most = -2.0;
  for (int i = 0; i < 4; ++i) {
    precise vec2 x = neighbours[i] - own, y = neighbours[(i + 1) & 3] - own;
    float turn = cross2(x, y);
    bool after = cross2(x, away) >= 0.0, before = cross2(away, y) > 0.0;
    if (turn > 0.0 ? after && before : after || before) {
      ++hits;
      hit = i;
    }
    vec2 middle = normalize(x) + normalize(y);
    float l = length(middle);
    float towards = l > 0.0 ? dot(middle / l, away) * (turn > 0.0 ? 1.0 : -1.0) : -1.0;
    if (towards > most) {
      most = towards;
      likely = i;
    }
  }
  return corners[hits == 1 ? hit : likely];
}

#endif
