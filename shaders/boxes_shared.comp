#version 460
// The whole box pyramid in one dispatch. Each workgroup reduces a tile of 64x64 texels of the
// base through six levels; the last workgroup to finish reduces level 6, which is one tile at
// most, through six more. The texels are those of boxes.comp.
// CPU twin: cpu/boxes.rs.
#include "fetch.glsl"

layout(local_size_x = 256) in;
layout(binding = 0) uniform sampler2D base;
// Workgroups that have finished; 0 before and after a dispatch.
layout(binding = 1, std430) coherent buffer Finished { uint finished; };
layout(binding = 2, rgba32f) uniform writeonly image2D level_1;
layout(binding = 3, rgba32f) uniform writeonly image2D level_2;
layout(binding = 4, rgba32f) uniform writeonly image2D level_3;
layout(binding = 5, rgba32f) uniform writeonly image2D level_4;
layout(binding = 6, rgba32f) uniform writeonly image2D level_5;
// Written by all workgroups and read by the last: only this level crosses between them.
layout(binding = 7, rgba32f) uniform coherent image2D level_6;
layout(binding = 8, rgba32f) uniform writeonly image2D level_7;
layout(binding = 9, rgba32f) uniform writeonly image2D level_8;
layout(binding = 10, rgba32f) uniform writeonly image2D level_9;
layout(binding = 11, rgba32f) uniform writeonly image2D level_10;
layout(binding = 12, rgba32f) uniform writeonly image2D level_11;
layout(binding = 13, rgba32f) uniform writeonly image2D level_12;

// How many levels there are.
layout(constant_id = 0) const int LEVELS = 12;

// Levels 2 to 6 of a tile, one after the other: 16x16, 8x8, 4x4, 2x2 and 1 texels.
shared vec4 tile[256 + 64 + 16 + 4 + 1];
shared bool is_last;

ivec2 size_of(int level) {
    return max(textureSize(base, 0) >> level, ivec2(1));
}

void store(int level, ivec2 ij, vec4 value) {
    if (level > LEVELS || any(greaterThanEqual(ij, size_of(level)))) return;
    switch (level) {
        case 1: imageStore(level_1, ij, value); break;
        case 2: imageStore(level_2, ij, value); break;
        case 3: imageStore(level_3, ij, value); break;
        case 4: imageStore(level_4, ij, value); break;
        case 5: imageStore(level_5, ij, value); break;
        case 6: imageStore(level_6, ij, value); break;
        case 7: imageStore(level_7, ij, value); break;
        case 8: imageStore(level_8, ij, value); break;
        case 9: imageStore(level_9, ij, value); break;
        case 10: imageStore(level_10, ij, value); break;
        case 11: imageStore(level_11, ij, value); break;
        case 12: imageStore(level_12, ij, value); break;
    }
}

// Texel `ij` of level 0 or 6.
vec4 source(int level, ivec2 ij) {
    return level == 0 ? FETCH_TEXEL(base, ij) : FETCH_IMAGE(level_6, ij);
}

// Reduces the tile `at` of 64x64 texels of level `first`, which is 0 or 6. Coordinates are
// clamped to their level: that joins a side of one texel with itself, and keeps what lies
// outside, which is never stored, to reads that are allowed.
void reduce(int first, ivec2 at) {
    int me = int(gl_LocalInvocationIndex);

    // Two levels in registers: 4x4 texels an invocation.
    ivec2 ij = 16 * at + ivec2(me % 16, me / 16);
    ivec2 end_0 = size_of(first) - 1;
    ivec2 end_1 = size_of(first + 1) - 1;
    vec4 sum = vec4(0.0);
    for (int k = 0; k < 4; ++k) {
        ivec2 own = 2 * ij + ivec2(k & 1, k >> 1);
        ivec2 a = min(2 * min(own, end_1), end_0);
        ivec2 b = min(a + 1, end_0);
        vec4 mean = 0.25 * (source(first, a) + source(first, ivec2(b.x, a.y))
                          + source(first, ivec2(a.x, b.y)) + source(first, b));
        store(first + 1, own, mean);
        sum += mean;
    }
    tile[me] = 0.25 * sum;
    store(first + 2, ij, 0.25 * sum);

    // Four levels in shared memory, each read from where the one before has left it.
    int from = 0;
    int to = 256;
    for (int level = first + 3, side = 8; side >= 1; ++level, side /= 2) {
        // The level before is in shared memory as a whole.
        barrier();
        if (me < side * side) {
            ivec2 local = ivec2(me % side, me / side);
            ivec2 end = clamp(size_of(level - 1) - 1 - 2 * side * at, ivec2(0), ivec2(2 * side - 1));
            ivec2 a = min(2 * local, end);
            ivec2 b = min(a + 1, end);
            int row_a = from + 2 * side * a.y;
            int row_b = from + 2 * side * b.y;
            vec4 mean = 0.25 * (tile[row_a + a.x] + tile[row_a + b.x] + tile[row_b + a.x] + tile[row_b + b.x]);
            tile[to + me] = mean;
            store(level, side * at + local, mean);
        }
        from = to;
        to += side * side;
    }
}

void main() {
    reduce(0, ivec2(gl_WorkGroupID.xy));
    if (LEVELS <= 6) return;

    // Invocation 0 has written the tile's only texel of level 6. What makes it visible to the
    // last workgroup: the texel's image is coherent; the barrier before the atomic releases the
    // write to the device, so that whoever sees the count sees the texel; counts are added one
    // after the other, so who reads the last sees all before it; the barrier after the atomic
    // acquires them; and barrier() hands this order on to the other invocations of the group.
    if (gl_LocalInvocationIndex == 0u) {
        memoryBarrier();
        uint before = atomicAdd(finished, 1u);
        is_last = before == gl_NumWorkGroups.x * gl_NumWorkGroups.y - 1u;
        memoryBarrier();
    }
    barrier();
    if (!is_last) return;
    memoryBarrier();
    reduce(6, ivec2(0));
    // For the next dispatch; nobody else counts any more.
    if (gl_LocalInvocationIndex == 0u) finished = 0u;
}
