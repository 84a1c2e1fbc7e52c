#version 460
#extension GL_EXT_control_flow_attributes : require
// The volume pass, halving: a grid of light from the one before it, by [1 3 3 1]/8 along each axis.
// CPU twin: halve in cpu/volume.rs.

layout(local_size_x = 64) in;
layout(binding = 0, std430) buffer Light { float light[]; };

layout(push_constant) uniform Halving {
    ivec4 from;  // cells along each axis; w: first cell
    ivec4 to;
} halving;

// Cells along each axis that an invocation makes: they share most of what they read, 27 cells each and not
// 64.
const int OUTPUTS = 2;
const int INPUTS = 2 * OUTPUTS + 2;

const float WEIGHTS[4] = float[](0.125, 0.375, 0.375, 0.125);

void main() {
    ivec3 blocks = (halving.to.xyz + OUTPUTS - 1) / OUTPUTS;
    int id = int((gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64 + gl_LocalInvocationID.x);
    ivec3 cell = OUTPUTS * ivec3(id % blocks.x, id / blocks.x % blocks.y, id / (blocks.x * blocks.y));
    if (cell.z >= halving.to.z) return;
    // Grids have one cell around the inner ones.
    ivec3 corner = 2 * cell - 2;

    float sum[OUTPUTS][OUTPUTS][OUTPUTS];
    [[unroll]] for (int o = 0; o < 8; ++o) sum[o >> 2][o >> 1 & 1][o & 1] = 0.0;
    [[unroll]] for (int k = 0; k < INPUTS; ++k) {
        [[unroll]] for (int j = 0; j < INPUTS; ++j) {
            float row[OUTPUTS] = float[](0.0, 0.0);
            [[unroll]] for (int i = 0; i < INPUTS; ++i) {
                ivec3 at = corner + ivec3(i, j, k);
                ivec3 inside = clamp(at, ivec3(0), halving.from.xyz - 1);
                float value = light[halving.from.w
                    + (inside.z * halving.from.y + inside.y) * halving.from.x + inside.x];
                value = inside == at ? value : 0.0;
                [[unroll]] for (int o = 0; o < OUTPUTS; ++o) {
                    int d = i - 2 * o;
                    if (d >= 0 && d < 4) row[o] += WEIGHTS[d] * value;
                }
            }
            [[unroll]] for (int o = 0; o < 8; ++o) {
                int d = j - 2 * (o >> 1 & 1), e = k - 2 * (o >> 2);
                if (d >= 0 && d < 4 && e >= 0 && e < 4) {
                    sum[o >> 2][o >> 1 & 1][o & 1] += WEIGHTS[d] * WEIGHTS[e] * row[o & 1];
                }
            }
        }
    }
    [[unroll]] for (int o = 0; o < 8; ++o) {
        ivec3 at = cell + ivec3(o & 1, o >> 1 & 1, o >> 2);
        if (all(lessThan(at, halving.to.xyz))) {
            light[halving.to.w + (at.z * halving.to.y + at.y) * halving.to.x + at.x] =
                sum[o >> 2][o >> 1 & 1][o & 1];
        }
    }
}
