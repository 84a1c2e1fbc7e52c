#version 460
#extension GL_EXT_control_flow_attributes : require
// The reduce pass, smoothing: all levels at once, by [1 4 6 4 1]/16 applied twice along each axis.
// CPU twin: smooth in cpu/reduce.rs; scene/pyramid.rs says where levels lie.
#include "fetch.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
#ifdef FOURTH
layout(binding = 0, r32f) uniform readonly image2D source_fourth;
#define SOURCE source_fourth
layout(binding = 1, r32f) uniform writeonly image2D target;
#else
layout(binding = 0, rgba32f) uniform readonly image2D source;
#define SOURCE source
layout(binding = 1, rgba32f) uniform writeonly image2D target;
#endif

// Mirrored by frame/reduce.rs.
const int MAX_LEVELS = 14;
layout(binding = 2, std140) uniform Levels {
    ivec4 content[MAX_LEVELS];  // first column and row, columns and rows
    ivec4 tiles[MAX_LEVELS];    // first tile of the level, and tiles a row
} levels;

// How many levels the table holds.
layout(constant_id = 0) const int LEVELS = 1;

// Texels along each axis that an invocation makes. They share most of what they read: 9 texels
// each and not 81. On llvmpipe a store costs as much as ten reads, so there is no pass of rows
// before one of columns, which would store everything twice.
const ivec2 OUTPUTS = ivec2(4, 4);

const float WEIGHTS[9] = float[](1.0 / 256.0, 8.0 / 256.0, 28.0 / 256.0, 56.0 / 256.0, 70.0 / 256.0,
                                 56.0 / 256.0, 28.0 / 256.0, 8.0 / 256.0, 1.0 / 256.0);

void main() {
    int tile = int(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x);
    int level = 0;
    while (level + 1 < LEVELS && tile >= levels.tiles[level + 1].x) ++level;
    ivec4 content = levels.content[level];
    tile -= levels.tiles[level].x;
    int line = tile / levels.tiles[level].y;
    ivec2 cell = ivec2(tile - line * levels.tiles[level].y, line) * 8
               + ivec2(gl_LocalInvocationID.xy);
    ivec2 first = OUTPUTS * cell;
    ivec2 last = imageSize(SOURCE) - 1;

    vec4 sum[OUTPUTS.y][OUTPUTS.x];
    [[unroll]] for (int o = 0; o < OUTPUTS.x * OUTPUTS.y; ++o) sum[o / OUTPUTS.x][o % OUTPUTS.x] = vec4(0.0);
    [[unroll]] for (int j = 0; j < OUTPUTS.y + 8; ++j) {
        vec4 row[OUTPUTS.x];
        [[unroll]] for (int p = 0; p < OUTPUTS.x; ++p) row[p] = vec4(0.0);
        [[unroll]] for (int i = 0; i < OUTPUTS.x + 8; ++i) {
            // Outside the image, as in the gaps between levels, all is 0.
            ivec2 at = content.xy + first + ivec2(i, j) - 4;
            ivec2 inside = clamp(at, ivec2(0), last);
            vec4 value = FETCH_IMAGE(SOURCE, inside);
            value = inside == at ? value : vec4(0.0);
            [[unroll]] for (int p = 0; p < OUTPUTS.x; ++p) {
                int d = i - p;
                if (d >= 0 && d <= 8) row[p] += WEIGHTS[d] * value;
            }
        }
        [[unroll]] for (int o = 0; o < OUTPUTS.y; ++o) {
            int d = j - o;
            if (d < 0 || d > 8) continue;
            [[unroll]] for (int p = 0; p < OUTPUTS.x; ++p) sum[o][p] += WEIGHTS[d] * row[p];
        }
    }
    [[unroll]] for (int o = 0; o < OUTPUTS.x * OUTPUTS.y; ++o) {
        ivec2 texel = first + ivec2(o % OUTPUTS.x, o / OUTPUTS.x);
        if (texel.x < content.z && texel.y < content.w) {
            imageStore(target, content.xy + texel, sum[o / OUTPUTS.x][o % OUTPUTS.x]);
        }
    }
    STORE_MOST_COUNTS();
}
