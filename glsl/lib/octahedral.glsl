// Octahedral encoding of unit vectors: Meyer, Suessmuth, Sussner, Stamminger, "On Floating-Point Normal Vectors"
// (2010).
// Binding-free: include it anywhere.
#ifndef EDGESHADE_OCTAHEDRAL
#define EDGESHADE_OCTAHEDRAL

vec2 octahedralSign(vec2 v) {
  return vec2(v.x >= 0.0 ? 1.0 : -1.0, v.y >= 0.0 ? 1.0 : -1.0); // sign() returns 0 where v is 0
}

// Maps a unit vector to [-1, 1]^2.
vec2 octahedralEncode(vec3 n) {
  vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
  return n.z >= 0.0 ? p : (1.0 - abs(p.yx)) * octahedralSign(p);
}

// Maps [-1, 1]^2 to a unit vector.
vec3 octahedralDecode(vec2 e) {
  vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * octahedralSign(n.xy);
  return normalize(n);
}

#endif
