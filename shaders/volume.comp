#version 460
// The volume pass, deposit: the base grid of light, made of the light map. Each texel's w goes to the eight
// cells around its point, by how near they are. An invocation owns a column of cells, so that it needs no
// atomics and the sums have one order. CPU twin: deposit in cpu/volume.rs; scene/volume.rs says where cells lie.
#include "fetch.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2D moments;
layout(binding = 1, std430) buffer Light { float light[]; };

layout(push_constant) uniform Deposit {
    vec4 place;   // cell of the map's corner in the middle of the depth range; w: cells a texel
    ivec4 size;   // cells along each axis; w: side of the map in texels
    float depth;  // half depth range in texels
    int reach;    // texels along a side that may lie nearer than a cell to a column
} deposit;

void main() {
    ivec2 column = ivec2(gl_GlobalInvocationID.xy);
    ivec3 size = deposit.size.xyz;
    if (any(greaterThanEqual(column, size.xy))) return;
    int stride = size.x * size.y;
    int first = column.y * size.x + column.x;
    for (int z = 0; z < size.z; ++z) light[first + z * stride] = 0.0;

    // In texels, whose centres are whole numbers here.
    float texels = 1.0 / deposit.place.w;
    vec2 middle = (vec2(column) + 0.5 - deposit.place.xy) * texels - 0.5;
    ivec2 corner = ivec2(ceil(middle - texels));
    ivec2 last = ivec2(deposit.size.w - 1);
    for (int j = 0; j < deposit.reach; ++j) {
        for (int i = 0; i < deposit.reach; ++i) {
            ivec2 at = corner + ivec2(i, j);
            ivec2 inside = clamp(at, ivec2(0), last);
            vec4 m = FETCH_TEXEL(moments, inside);
            vec2 near = max(1.0 - abs(vec2(at) - middle) * deposit.place.w, 0.0);
            float w = inside == at ? m.x * near.x * near.y : 0.0;
            float z = m.y / max(m.x, 1e-20) * deposit.depth;
            float slice = z * deposit.place.w + deposit.place.z - 0.5;
            int lower = clamp(int(floor(slice)), 0, size.z - 2);
            float f = slice - float(lower);
            int cell = first + lower * stride;
            light[cell] += w * (1.0 - f);
            light[cell + stride] += w * f;
        }
    }
    STORE_MOST_COUNTS();
}
