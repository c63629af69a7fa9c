// Classes of whole tiles of 8 x 8 pixels, which need no receiver of every pixel: bounds over the tile's depths and normals
// decide all of them by one look at the map. A tile's class is never wrong, but most tiles with a shadow edge, a silhouette
// or the sky in them stay open: those are left for common/quad_classes.glsl.
// Include after common/hsm.glsl and common/pixel_steps.glsl.
//
// All bounds are relative to the plane of one receiver of the tile, its base, in the shadow map. In the map's space planes
// stay planes. So over that plane the depth of a receiver p is lower by
//
//   G e w0/w,   e = n0 (p - p0),
//
// where G is the length of the gradient of depth minus plane at the base p0, n0 the base's normal, and w the distance along
// the light's axis (1 under a sun). The slope of the plane of a receiver with the normal n is Q n/T, T = n (light - p), or
// n (towards the light) under a sun, with a constant matrix Q.
#ifndef EDGESHADE_TILE_CLASSES
#define EDGESHADE_TILE_CLASSES
#extension GL_EXT_control_flow_attributes : require

// Bounds of a tile's pixels in camera space.
struct TilePixels {
  bool sky, surface; // whether there are pixels of the kind; depths and normals that are no numbers count as sky
  vec2 depth;        // least and largest stored depth
  vec2 elevation;    // least and largest e, world units
  float turn;        // largest length of the difference of a normal from the base's
};

// Bound of the length of the difference of two unit normals whose encodings differ by at most `d` in every component. The
// octahedron's faces rise by as much as |x| + |y|, and no point of it is nearer to the origin than sqrt(1/3).
float normalTurn(float d, vec3 encoded) {
  float cartesian = 3.5 / length(encoded), octahedral = view.normal_encoding == NORMAL_OCTAHEDRAL_UNSIGNED ? 8.6 : 4.3;
  return d * (view.normal_encoding == NORMAL_CARTESIAN ? cartesian : octahedral);
}

TilePixels tilePixels(ivec2 corner, ivec2 base, Receiver r) {
  vec4 plane = vec4(r.normal, -dot(r.normal, r.position)) * view.view_from_clip;
  vec4 w_row = vec4(view.view_from_clip[0][3], view.view_from_clip[1][3], view.view_from_clip[2][3], view.view_from_clip[3][3]);
  vec3 encoded = texelFetch(camera_normal, base, 0).xyz;
  int components = view.normal_encoding == NORMAL_CARTESIAN ? 3 : 2;
  TilePixels t = TilePixels(false, false, vec2(3.0e38, -3.0e38), vec2(3.0e38, -3.0e38), 0.0);
  float apart = 0.0;
  [[dont_unroll]] for (int i = 0; i < 16; ++i) {
    ivec2 quad = corner + 2 * ivec2(i & 3, i >> 2);
    // One gather at the common corner of the four: rounding cannot select other pixels there.
    vec2 at = vec2(quad + 1) / vec2(view.size);
    vec4 d = textureGather(camera_depth, at);
    bvec4 is_sky = equal(d, vec4(view.far_depth)), is_number = lessThan(abs(d), vec4(3.0e38));
    t.sky = t.sky || any(is_sky) || !all(is_number);
    t.surface = t.surface || !all(is_sky);
    t.depth = vec2(min(t.depth.x, min(min(d.x, d.y), min(d.z, d.w))), max(t.depth.y, max(max(d.x, d.y), max(d.z, d.w))));
    // In gather order: (0, 1), (1, 1), (1, 0), (0, 0).
    vec4 x = (2.0 * (vec4(quad.x) + vec4(0.0, 1.0, 1.0, 0.0)) + 1.0) / float(view.size.x) - 1.0;
    vec4 y = (2.0 * (vec4(quad.y) + vec4(1.0, 1.0, 0.0, 0.0)) + 1.0) / float(view.size.y) - 1.0;
    vec4 e = (plane.x * x + plane.y * y + plane.z * d + plane.w) / (w_row.x * x + w_row.y * y + w_row.z * d + w_row.w);
    t.elevation = vec2(min(t.elevation.x, min(min(e.x, e.y), min(e.z, e.w))), max(t.elevation.y, max(max(e.x, e.y), max(e.z, e.w))));
    [[dont_unroll]] for (int k = 0; k < (all(is_sky) ? 0 : components); ++k) {
      vec4 n = k == 0 ? textureGather(camera_normal, at, 0) : k == 1 ? textureGather(camera_normal, at, 1) : textureGather(camera_normal, at, 2);
      vec4 off = abs(n - encoded[k]);
      t.sky = t.sky || !all(lessThan(off, vec4(3.0e38)));
      apart = max(apart, max(max(off.x, off.y), max(off.z, off.w)));
    }
  }
  t.turn = normalTurn(apart, encoded);
  return t;
}

// A tile's receivers as the shadow map sees them.
struct TileReceivers {
  vec2 low, high; // places in the map, texels
  float z;        // largest linear distance
  vec2 at;        // place of the base, texels
  float depth;    // and its depth
  vec2 slope;     // of the base's plane, depth per texel
  vec2 turn;      // largest difference of a receiver's slope from it
  vec2 shift;     // least and largest depth over the base's plane of a receiver, bias subtracted
  float texel_depth; // largest one, see MapReceiver
};

// Returns the class of a tile that needs no texel of the shadow map; otherwise HSM_PENUMBRA, and `is_bounded` tells whether
// `t` holds the tile's receivers. The settings are those of mapReceiver; `is_fixed`: texels are compared with the receivers'
// own depth.
int tileReceivers(ivec2 corner, AreaLight a, float normal_offset, float depth_bias, bool is_fixed, out TileReceivers t, out bool is_bounded) {
  is_bounded = false;
  // One condition, as common/receiver.glsl explains: normals from depth, or a tile that leaves the image.
  if (any(bvec3(view.normal_encoding == NORMAL_NONE, greaterThan(corner + 8, ivec2(view.size))))) return HSM_PENUMBRA;
  ivec2 base = corner + 4;
  Receiver r = receiverAt(base);
  TilePixels p = tilePixels(corner, base, r);
  if (!p.surface) return HSM_LIT;
  if (p.sky) return HSM_PENUMBRA;

  mat4 m = view.light_clip_from_view[0];
  vec2 map_size = vec2(view.map_size);
  vec3 row_w = rowOf(m, 3);
  // The receivers lie within the hull of these points.
  float reach = 0.0;         // largest distance from the base
  float depth_error = 0.0; // largest error of a position by that of the camera's depth
  vec2 w = vec2(3.0e38, -3.0e38), depth = w;
  t.low = vec2(3.0e38);
  t.high = vec2(-3.0e38);
  bvec4 outside = bvec4(true); // all points lie beyond the side of the light's view
  [[dont_unroll]] for (int i = 0; i < 8; ++i) {
    ivec2 pixel = corner + 7 * ivec2(i & 1, i >> 1 & 1);
    float pixel_depth = i < 4 ? p.depth.x : p.depth.y;
    vec3 corner_position = viewPosition(pixel, pixel_depth);
    depth_error = max(depth_error, distance(corner_position, viewPosition(pixel, pixel_depth + view.depth_error)));
    vec4 q = m * vec4(corner_position, 1.0);
    reach = max(reach, distance(corner_position, r.position));
    w = vec2(min(w.x, q.w), max(w.y, q.w));
    float rest = 1.001 * q.w;
    outside = bvec4(outside.x && q.x > rest, outside.y && q.x < -rest, outside.z && q.y > rest, outside.w && q.y < -rest);
    vec3 l = q.xyz / q.w;
    vec2 at = (0.5 * l.xy + 0.5) * map_size;
    t.low = min(t.low, at);
    t.high = max(t.high, at);
    depth = vec2(min(depth.x, l.z), max(depth.y, l.z));
  }

  // Facing: T over all receivers.
  vec4 light = view.light_position_view[0];
  bool is_spot = light.w != 0.0;
  vec3 to_light = light.xyz - light.w * r.position;
  float far = length(to_light), facing = dot(r.normal, to_light);
  // Bound of the error by which receivers leave the light (receiverAt). Elevations and positions round by as much.
  float rounding = POSITION_ULPS * (length(r.position) + reach);
  vec2 elevation = p.elevation + 2.0 * rounding * vec2(-1.0, 1.0);
  float spot = is_spot ? 1.0 : 0.0;
  float change = p.turn * (far + spot * reach) + spot * max(abs(elevation.x), abs(elevation.y)) + 1e-5 * far;
  if (facing + change < 0.0) return HSM_UMBRA;
  if (facing - change > 0.0 && w.x > 0.0 && any(outside)) return HSM_LIT;

  // Offsets along the normals, world units.
  LightPoint l = lightSpace(r.position, 0);
  if (!(w.x > 0.0) || !l.inside) return HSM_PENUMBRA;
  float size = texelSize(m, l, map_size) / l.w, step = planeOffsetTexels(m, r.normal);
  float least_offset = normal_offset * size * w.x * max(step - p.turn, 0.0) * 0.9999 + max(rounding - 2.0 * POSITION_ULPS * reach, 0.0);
  float largest_offset = normal_offset * size * w.y * (step + p.turn) * 1.0001 + rounding + 1.0001 * depth_error;
  change += spot * largest_offset;
  // Planes seen nearly edge-on have no reliable slope.
  if (facing - change < 0.01 * (far + spot * (reach + largest_offset))) return HSM_PENUMBRA;

  // Gradients of place (uv) and depth, see receiverPlane.
  float inverse_w = 1.0 / l.w;
  vec3 U = 0.5 * inverse_w * (rowOf(m, 0) - l.ndc.x * row_w), V = 0.5 * inverse_w * (rowOf(m, 1) - l.ndc.y * row_w);
  vec3 D_spot = view.light_depth_scale[0] * inverse_w * inverse_w * row_w, D_sun = rowOf(m, 2);
  vec3 D = view.light_depth_scale[0] > 0.0 ? D_spot : D_sun;
  vec2 plane = receiverPlane(m, view.light_depth_scale[0], l, r.normal);
  float gradient = length(D - plane.x * U - plane.y * V);
  w += length(row_w) * largest_offset * vec2(-1.0, 1.0);
  if (!(w.x > 0.5 * l.w)) return HSM_PENUMBRA;

  // Slopes.
  t.slope = plane / map_size;
  vec2 q_rows = vec2(length(cross(D, V)), length(cross(U, D))) * facing / abs(dot(r.normal, cross(U, V))) / map_size;
  t.turn = (q_rows * p.turn + abs(t.slope) * change) / (facing - change) + 1e-5 * abs(t.slope);
  float bias = DEPTH_ULPS + depth_bias * (abs(t.slope.x) + abs(t.slope.y)), bias_turn = depth_bias * (t.turn.x + t.turn.y);

  // Places and depths, with the offsets. The gradients grow with 1/w; 2 bounds the growth over the tile.
  vec2 moved = 2.0 * largest_offset * map_size * vec2(length(U) + length(row_w) * inverse_w, length(V) + length(row_w) * inverse_w) + 0.01;
  float rise = 4.0 * largest_offset * length(D) + 1e-6;
  t.low -= moved;
  t.high += moved;
  depth += rise * vec2(-1.0, 1.0);
  bool inside = all(greaterThan(t.low, vec2(0.0))) && all(lessThan(t.high, map_size)) && depth.x > 0.0 && depth.y < 1.0;
  if (!inside) return HSM_PENUMBRA;
  t.z = lightDistance(a, depth.y);
  t.at = l.uv * map_size;
  t.depth = l.depth;
  // Under a spot light it falls with w.
  t.texel_depth = texelDepth(m, view.light_depth_scale[0], l, map_size) * max(1.001 * l.w / w.x, 1.0);

  // Depth over the base's plane. A normal that turns by x has the component 1 - x x/2 along the base's.
  vec2 e = elevation + vec2(least_offset * max(1.0 - 0.5 * p.turn * p.turn, 0.0), largest_offset);
  vec2 scale = l.w / vec2(w.y, w.x); // least and largest
  t.shift = -gradient * vec2(max(e.y * scale.x, e.y * scale.y), min(e.x * scale.x, e.x * scale.y));
  if (is_fixed) {
    t.shift = depth - l.depth;
    t.slope = t.turn = vec2(0.0);
  }
  t.shift += vec2(-bias - bias_turn, bias_turn - bias);
  // Rounding of the receivers' own depths and places.
  float own = DEPTH_ULPS + POSITION_ULPS * dot(abs(t.slope), map_size);
  t.shift += own * vec2(-1.0, 1.0);
  is_bounded = true;
  return HSM_PENUMBRA;
}

// Classifies a tile. `nearest_blocker` and `reach` are those of searchWindow, `margin` that of classify; `least_texels` is an
// upper bound of the least half-widths of the search windows.
int classifyTile(sampler2D hsm, sampler2D blocks, ivec2 corner, AreaLight a, float normal_offset, float depth_bias, bool is_fixed,
                 bool nearest_blocker, float reach, float least_texels, float margin) {
  TileReceivers t;
  bool is_bounded;
  int found = tileReceivers(corner, a, normal_offset, depth_bias, is_fixed, t, is_bounded);
  // The base's plane, raised to the largest depth of any receiver over it.
  SoftReceiver r;
  r.at = t.at;
  r.slope = t.slope;
  vec2 half_texels = max(windowTexels(searchHalfWidth(a, t.z, a.near) * reach), vec2(least_texels));
  ivec2 first, last;
  float drop = 0.0;
  int rounds = nearest_blocker ? 3 : 1;
  [[dont_unroll]] for (int k = 0; k < rounds && is_bounded && found == HSM_PENUMBRA; ++k) {
    vec2 around = half_texels * 1.00002 + (margin + 0.02);
    first = ivec2(floor(t.low - around));
    last = ivec2(floor(t.high + around));
    float turned = dot(t.turn, around + 1.0);
    r.map.depth = t.depth + t.shift.y + turned;
    drop = t.shift.y - t.shift.x + 2.0 * turned;
    vec2 bounds = hsmBounds(hsm, first, last);
    found = classifyBounds(r, bounds, first, last, drop);
    float nearest = max(lightDistance(a, bounds.x), a.near);
    if (k + 1 < rounds) half_texels = max(windowTexels(searchHalfWidth(a, t.z, nearest) * reach), vec2(least_texels));
  }
  [[dont_unroll]] for (int k = 0; k < 1 && is_bounded && found == HSM_PENUMBRA; ++k) {
    found = classifyBlocks(blocks, r, first, last, drop);
  }
  return found;
}

// Classifies a tile whose pixels test all texels within `reach` texels of their own, along each axis, on their planes. The
// receivers may lie in front of these by `slack` times their texel depth per texel of distance.
int classifyKernels(sampler2D blocks, ivec2 corner, float normal_offset, float depth_bias, float slack, bool is_fixed, float reach) {
  TileReceivers t;
  bool is_bounded;
  // Only a light's area needs the distances.
  int found = tileReceivers(corner, AreaLight(vec2(0.0), 0.0, 0.0, 1.0, 0.0), normal_offset, depth_bias, is_fixed, t, is_bounded);
  [[dont_unroll]] for (int k = 0; k < 1 && is_bounded && found == HSM_PENUMBRA; ++k) {
    ivec2 first = ivec2(floor(t.low - reach - 0.02)), last = ivec2(floor(t.high + reach + 0.02));
    float turned = dot(t.turn, vec2(reach + 1.02));
    SoftReceiver r;
    r.at = t.at;
    r.slope = t.slope;
    r.map.depth = t.depth + t.shift.y + turned;
    float drop = t.shift.y - t.shift.x + 2.0 * turned + slack * t.texel_depth * float(last.x - first.x + last.y - first.y);
    found = classifyBlocks(blocks, r, first, last, drop);
  }
  return found;
}

#endif
