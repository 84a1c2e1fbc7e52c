#version 460
// Moments T0 = (w, wz, wz^2, wz^3) of what the light sees (DESIGN, the frame). The weight
// w = coverage * Ft(theta) is the share of the texel's flux that enters the medium.
#include "shared.glsl"
#include "fresnel.glsl"

layout(location = 0) in vec3 in_normal;
layout(location = 1) in float in_z;
layout(location = 0) out vec4 out_moments;
#ifdef FOURTH
layout(location = 1) out float out_fourth;
#endif

void main() {
    vec3 n = normalize(in_normal);
    // A triangle seen from behind belongs to an open sheet, which is lit on either side.
    n = gl_FrontFacing ? n : -n;
    float w = fresnel_transmittance(-dot(n, frame.light_z.xyz), frame.sigma_tr.w);
    float wz = w * in_z;
    out_moments = vec4(w, wz, wz * in_z, wz * in_z * in_z);
#ifdef FOURTH
    out_fourth = out_moments.w * in_z;
#endif
}
