#version 460
#extension GL_EXT_control_flow_attributes : require
// What one fetch costs on this device: a full screen of READS fetches of one kind, a few texels apart, and next to
// nothing else. See frame/probe.rs.
#include "fetch.glsl"

#if defined(GATHER)
layout(binding = 0) uniform sampler2DShadow probed;
#elif defined(VOLUME)
layout(binding = 0) uniform sampler3D probed;
#elif defined(STORAGE)
layout(binding = 0, rgba32f) uniform readonly image2D probed;
#elif defined(STORAGE_SCALAR)
layout(binding = 0, r32f) uniform readonly image2D probed;
#else
layout(binding = 0) uniform sampler2D probed;
#endif

layout(location = 0) out vec4 out_sum;

layout(constant_id = 0) const int READS = 16;

const float SIDE = 512.0;

void main() {
    vec4 sum = vec4(0.0);
    [[unroll]] for (int i = 0; i < READS; ++i) {
        // Between texels, a few further each time, as the taps of neighbouring levels are.
        vec2 st = gl_FragCoord.xy + vec2(1.25, 0.75) * float(i);
#if defined(GATHER)
        sum += FETCH_GATHER_COMPARE(probed, st, SIDE, 0.5);
#elif defined(VOLUME)
        sum.x += FETCH_VOLUME(probed, vec3(st * 0.125, 16.0 + 0.3 * float(i)), vec3(1.0 / 64.0));
#elif defined(STORAGE) || defined(STORAGE_SCALAR)
        sum += FETCH_IMAGE(probed, min(ivec2(st), ivec2(SIDE - 1.0)));
#elif defined(TEXEL)
        sum += FETCH_TEXEL(probed, min(ivec2(st), ivec2(SIDE - 1.0)));
#else
        sum += FETCH_FILTERED(probed, st, vec2(1.0 / SIDE));
#endif
    }
    out_sum = sum;
}
