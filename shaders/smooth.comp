#version 460
#extension GL_EXT_control_flow_attributes : require
// The reduce pass, smoothing: all levels at once along one axis, by [1 4 6 4 1]/16 applied twice.
// CPU twin: smooth in cpu/reduce.rs; scene/pyramid.rs says where levels lie.
#include "fetch.glsl"

// The axis. A group of columns is wide: groups of 8x8 took half as long again on llvmpipe, where each
// row of the image lies in pages of its own.
#ifdef COLUMNS
const ivec2 ALONG = ivec2(0, 1);
layout(local_size_x = 64, local_size_y = 1) in;
#else
const ivec2 ALONG = ivec2(1, 0);
layout(local_size_x = 8, local_size_y = 8) in;
#endif

layout(binding = 0) uniform sampler2D source;
layout(binding = 1, rgba32f) uniform writeonly image2D target;

// Mirrored by frame/reduce.rs.
const int MAX_LEVELS = 14;
layout(binding = 2, std140) uniform Levels {
    ivec4 content[MAX_LEVELS];  // first column and row, columns and rows
    ivec4 tiles[MAX_LEVELS];    // first tile of the level, and tiles a row
} levels;

#ifdef FOURTH
layout(binding = 3) uniform sampler2D source_fourth;
layout(binding = 4, r32f) uniform writeonly image2D target_fourth;
#endif

// How many levels the table holds.
layout(constant_id = 0) const int LEVELS = 1;

// Neighbours along the axis that an invocation makes. They share most of what they read: of 1, 2, 4
// and 8, four took the least time on llvmpipe over both axes.
const int OUTPUTS = 4;

const float WEIGHTS[9] = float[](1.0 / 256.0, 8.0 / 256.0, 28.0 / 256.0, 56.0 / 256.0, 70.0 / 256.0,
                                 56.0 / 256.0, 28.0 / 256.0, 8.0 / 256.0, 1.0 / 256.0);

// A texel, or 0 outside the image.
vec4 read(sampler2D tex, ivec2 texel, ivec2 size) {
    ivec2 inside = clamp(texel, ivec2(0), size - 1);
    vec4 value = FETCH_TEXEL(tex, inside);
    return inside == texel ? value : vec4(0.0);
}

void smoothed(sampler2D tex, ivec2 texel, ivec2 size, out vec4 sum[OUTPUTS]) {
    [[unroll]] for (int o = 0; o < OUTPUTS; ++o) sum[o] = vec4(0.0);
    [[unroll]] for (int k = 0; k < OUTPUTS + 8; ++k) {
        vec4 value = read(tex, texel + (k - 4) * ALONG, size);
        [[unroll]] for (int o = 0; o < OUTPUTS; ++o) {
            int d = k - o;
            if (d >= 0 && d <= 8) sum[o] += WEIGHTS[d] * value;
        }
    }
}

void main() {
    int tile = int(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x);
    int level = 0;
    while (level + 1 < LEVELS && tile >= levels.tiles[level + 1].x) ++level;
    ivec4 content = levels.content[level];
    tile -= levels.tiles[level].x;
    int row = tile / levels.tiles[level].y;
    ivec2 cell = ivec2(tile - row * levels.tiles[level].y, row) * ivec2(gl_WorkGroupSize.xy)
               + ivec2(gl_LocalInvocationID.xy);
    ivec2 first = cell * (1 + (OUTPUTS - 1) * ALONG);
    ivec2 size = textureSize(source, 0);
    vec4 sum[OUTPUTS];
    smoothed(source, content.xy + first, size, sum);
    [[unroll]] for (int o = 0; o < OUTPUTS; ++o) {
        ivec2 texel = first + o * ALONG;
        if (texel.x < content.z && texel.y < content.w) {
            imageStore(target, content.xy + texel, sum[o]);
        }
    }
#ifdef FOURTH
    smoothed(source_fourth, content.xy + first, size, sum);
    [[unroll]] for (int o = 0; o < OUTPUTS; ++o) {
        ivec2 texel = first + o * ALONG;
        if (texel.x < content.z && texel.y < content.w) {
            imageStore(target_fourth, content.xy + texel, sum[o]);
        }
    }
#endif
}
