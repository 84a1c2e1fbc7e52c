#version 460
// The reduce pass, halving: a level of the light map's pyramid from the one before it, by
// [1 3 3 1]/8 along each axis. CPU twin: decimate in cpu/reduce.rs; scene/pyramid.rs says where
// levels lie.
#include "fetch.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
// Source and target are rectangles of one image, which do not overlap.
layout(binding = 0) uniform sampler2D source;
layout(binding = 1, rgba32f) uniform writeonly image2D target;
#ifdef FOURTH
layout(binding = 2) uniform sampler2D source_fourth;
layout(binding = 3, r32f) uniform writeonly image2D target_fourth;
#endif

layout(push_constant) uniform Halving {
    ivec2 from;   // interior's corner of the level that is read
    ivec2 to;     // interior's corner of the level that is written
    ivec2 size;   // columns and rows that are written, from column and row -1 on
} halving;

// Two texels of weights 1/8 and 3/8 an axis are one bilinear tap of weight 1/2, three quarters of
// a texel from the middle.
vec4 halved(sampler2D tex, vec2 middle, vec2 unit) {
    const float tap = 0.75;
    return 0.25 * ((FETCH_LINEAR(tex, middle + vec2(-tap, -tap), unit)
                  + FETCH_LINEAR(tex, middle + vec2(tap, -tap), unit))
                 + (FETCH_LINEAR(tex, middle + vec2(-tap, tap), unit)
                  + FETCH_LINEAR(tex, middle + vec2(tap, tap), unit)));
}

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (texel.x >= halving.size.x || texel.y >= halving.size.y) return;
    texel -= 1;
    vec2 middle = vec2(halving.from + 2 * texel + 1);
    vec2 unit = 1.0 / vec2(textureSize(source, 0));
    imageStore(target, halving.to + texel, halved(source, middle, unit));
#ifdef FOURTH
    imageStore(target_fourth, halving.to + texel, halved(source_fourth, middle, unit));
#endif
}
