#version 460
#extension GL_EXT_control_flow_attributes : require
// The volume pass, blur: a grid blurred along one axis, from one buffer to another. CPU twin: blur in
// cpu/volume.rs.

layout(local_size_x = 64) in;
layout(binding = 0, std430) readonly buffer Source { float source[]; };
layout(binding = 1, std430) writeonly buffer Target { float target[]; };

layout(push_constant) uniform Blur {
    ivec4 size;         // cells along each axis; w: the axis
    ivec2 first;        // first cell in the source, and in the target
    float weights[10];  // from the middle outwards
} blur;

layout(constant_id = 0) const int RADIUS = 4;

// Cells along the axis that an invocation makes: they share most of what they read.
const int OUTPUTS = 8;

void main() {
    int axis = blur.size.w;
    ivec3 size = blur.size.xyz;
    ivec3 blocks = size;
    blocks[axis] = (size[axis] + OUTPUTS - 1) / OUTPUTS;
    int id = int((gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64 + gl_LocalInvocationID.x);
    ivec3 cell = ivec3(id % blocks.x, id / blocks.x % blocks.y, id / (blocks.x * blocks.y));
    if (cell.z >= blocks.z) return;
    int start = OUTPUTS * cell[axis];
    cell[axis] = 0;
    int line = (cell.z * size.y + cell.y) * size.x + cell.x;
    int stride = axis == 0 ? 1 : axis == 1 ? size.x : size.x * size.y;
    int count = size[axis];

    float sum[OUTPUTS];
    [[unroll]] for (int o = 0; o < OUTPUTS; ++o) sum[o] = 0.0;
    [[unroll]] for (int i = 0; i < OUTPUTS + 2 * RADIUS; ++i) {
        int at = start + i - RADIUS;
        int inside = clamp(at, 0, count - 1);
        float value = source[blur.first.x + line + inside * stride];
        value = inside == at ? value : 0.0;
        [[unroll]] for (int o = 0; o < OUTPUTS; ++o) {
            int d = abs(i - RADIUS - o);
            if (d <= RADIUS) sum[o] += blur.weights[d] * value;
        }
    }
    [[unroll]] for (int o = 0; o < OUTPUTS; ++o) {
        if (start + o < count) target[blur.first.y + line + (start + o) * stride] = sum[o];
    }
}
