#version 460
// The boxes pass: one level of the box pyramid, each texel the mean of 2x2 of the level above.
// An odd last row or column is dropped, and along a side of one texel nothing is averaged.
// CPU twin: cpu/boxes.rs.
#include "fetch.glsl"

// A row of texels: measured against squares and other lengths on llvmpipe.
layout(local_size_x = 64) in;
layout(binding = 0, rgba32f) uniform readonly image2D source;
layout(binding = 1, rgba32f) uniform writeonly image2D target;

void main() {
    ivec2 ij = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(ij, imageSize(target)))) return;
    ivec2 a = 2 * ij;
    // Along a side of one texel that texel again.
    ivec2 b = min(a + 1, imageSize(source) - 1);
    vec4 sum = FETCH_IMAGE(source, a) + FETCH_IMAGE(source, ivec2(b.x, a.y))
             + FETCH_IMAGE(source, ivec2(a.x, b.y)) + FETCH_IMAGE(source, b);
    imageStore(target, ij, 0.25 * sum);
    STORE_MOST_COUNTS();
}
