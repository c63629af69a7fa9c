#version 460
// Revectorized visibility: silhouette recovery, filtering, RBSM* and the edge profile; see lib/rbsm*.glsl.
#extension GL_GOOGLE_include_directive : require
layout(constant_id = 1) const int MAX_DISTANCE = 16;
#define MAXDIST MAX_DISTANCE
#include "edge_list.glsl"
#include "rbsm_function.glsl"
