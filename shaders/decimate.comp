#version 460
#extension GL_EXT_control_flow_attributes : require
// The reduce pass, halving: a level of the light map's pyramid from the one before it, by
// [1 3 3 1]/8 along each axis. CPU twin: decimate in cpu/reduce.rs; scene/pyramid.rs says where
// levels lie.
#include "fetch.glsl"

layout(local_size_x = 32, local_size_y = 1) in;
// Source and target are rectangles of one image, which do not overlap.
layout(binding = 0, rgba32f) uniform image2D moments;
#ifdef FOURTH
layout(binding = 1, r32f) uniform image2D fourth;
#endif

layout(push_constant) uniform Halving {
    ivec2 from;   // interior's corner of the level that is read
    ivec2 to;     // interior's corner of the level that is written
    ivec2 size;   // columns and rows that are written, from column and row -1 on
} halving;

// Texels along each axis that an invocation makes: they share most of what they read, 9 texels
// each and not 16.
const int OUTPUTS = 2;
const int INPUTS = 2 * OUTPUTS + 2;

const float WEIGHTS[4] = float[](0.125, 0.375, 0.375, 0.125);

// Sums rows of `image` around the outputs from `texel` on, and stores them where they are asked for.
#define HALVE(image)                                                                        \
    {                                                                                       \
        vec4 sum[OUTPUTS][OUTPUTS];                                                         \
        [[unroll]] for (int j = 0; j < INPUTS; ++j) {                                       \
            vec4 row[OUTPUTS];                                                              \
            [[unroll]] for (int i = 0; i < INPUTS; ++i) {                                   \
                ivec2 at = corner + ivec2(i, j);                                            \
                ivec2 inside = clamp(at, ivec2(0), last);                                   \
                vec4 value = FETCH_IMAGE(image, inside);                                    \
                value = inside == at ? value : vec4(0.0);                                   \
                [[unroll]] for (int o = 0; o < OUTPUTS; ++o) {                              \
                    int d = i - 2 * o;                                                      \
                    if (d == 0) row[o] = WEIGHTS[d] * value;                                \
                    else if (d > 0 && d < 4) row[o] += WEIGHTS[d] * value;                  \
                }                                                                           \
            }                                                                               \
            [[unroll]] for (int o = 0; o < OUTPUTS; ++o) {                                  \
                int d = j - 2 * o;                                                          \
                [[unroll]] for (int p = 0; p < OUTPUTS; ++p) {                              \
                    if (d == 0) sum[o][p] = WEIGHTS[d] * row[p];                            \
                    else if (d > 0 && d < 4) sum[o][p] += WEIGHTS[d] * row[p];              \
                }                                                                           \
            }                                                                               \
        }                                                                                   \
        [[unroll]] for (int o = 0; o < OUTPUTS * OUTPUTS; ++o) {                            \
            ivec2 at = texel + ivec2(o % OUTPUTS, o / OUTPUTS);                             \
            if (all(lessThan(at + 1, halving.size))) {                                      \
                imageStore(image, halving.to + at, sum[o / OUTPUTS][o % OUTPUTS]);          \
            }                                                                               \
        }                                                                                   \
    }

void main() {
    ivec2 texel = OUTPUTS * ivec2(gl_GlobalInvocationID.xy) - 1;
    ivec2 corner = halving.from + 2 * texel - 1;
    ivec2 last = imageSize(moments) - 1;
    HALVE(moments)
#ifdef FOURTH
    HALVE(fourth)
#endif
    STORE_MOST_COUNTS();
}
