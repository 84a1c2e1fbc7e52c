#version 460
// The resolve pass: the running mean over jittered frames, and its encoding for display.
// CPU twin: cpu/resolve.rs.
#include "shared.glsl"
#include "fetch.glsl"

layout(binding = 1) uniform sampler2D radiance;
// The mean of the frames before this one. Frames take turns with two images: none reads what it writes.
layout(binding = 2) uniform sampler2D mean;
#include "history.glsl"
layout(location = 0) out vec4 out_mean;
// Only what is shown needs the encoding.
#ifdef ENCODE
layout(location = 1) out vec4 out_display;
#endif

// Whether more frames than one are averaged: one alone has no mean before it to read.
layout(constant_id = 0) const bool HISTORY = true;

// Identity up to 0.8, then a shoulder that reaches 1 with a continuous slope.
vec3 tone_map(vec3 x) {
    return mix(x, 1.0 - 0.2 * exp(-(x - 0.8) / 0.2), greaterThan(x, vec3(0.8)));
}

// The transfer function of sRGB (IEC 61966-2-1).
vec3 encode_srgb(vec3 x) {
    return mix(12.92 * x, 1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, greaterThan(x, vec3(0.0031308)));
}

void main() {
    // The nearest texel to a texel's centre: on llvmpipe a sampler finds it faster than texelFetch.
    vec2 pixel = gl_FragCoord.xy;
    ivec2 size = textureSize(radiance, 0);
    vec4 value = FETCH_NEAREST(radiance, pixel, size);
    if (HISTORY) {
        // The first frame has none before it, and what it would read is undefined: undefined * 0 may be NaN.
        if (frame.sequence.z < 1.0) {
            vec4 old = FETCH_NEAREST(mean, pixel, size);
            value = old + (value - old) * frame.sequence.z;
        }
    }
#ifdef LIVE
    // In place of the mean: this variant runs without HISTORY.
    value = joined(pixel, size, value);
#endif
    out_mean = value;
    STORE_COUNTS(ivec2(pixel), false);

#ifdef ENCODE
    // Radiance is premultiplied by coverage; the PNG's alpha is straight.
    float alpha = value.a;
    vec3 color = tone_map(max(vec3(0.0), value.rgb * frame.z_v.w) / max(alpha, 1e-6));
    if (frame.background.w > 0.0) {
        color = mix(frame.background.rgb, color, alpha);
        alpha = 1.0;
    }
    out_display = vec4(encode_srgb(clamp(color, 0.0, 1.0)), alpha);
#endif
}
