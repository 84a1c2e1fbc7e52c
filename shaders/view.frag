#version 460
#include "shared.glsl"

layout(location = 0) in vec3 in_normal;
layout(location = 0) out vec2 out_normal;
#ifdef MOTION
#include "motion.glsl"
layout(location = 1) in vec3 in_now;
layout(location = 2) in vec3 in_before;
// Where this point of the surface was, minus where it is, pixels.
layout(location = 1) out vec2 out_motion;
#endif

void main() {
    vec3 n = normalize(in_normal);
    out_normal = encode_normal(gl_FrontFacing ? n : -n);
#ifdef MOTION
    // What was behind the eye was in no picture.
    vec2 motion = 0.5 * reprojection.picture.xy * (in_before.xy / in_before.z - in_now.xy / in_now.z);
    out_motion = in_before.z > 0.0 ? motion : vec2(1e9);
#endif
}
