#version 460
// The light pass: casters seen from the light. CPU twin: cpu/light.rs.
#include "shared.glsl"

layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
layout(location = 0) out vec3 out_normal;
layout(location = 1) out float out_z;

void main() {
    gl_Position = frame.light_proj * vec4(in_position, 1.0);
    out_normal = in_normal;
    out_z = to_light_space(in_position).z;
}
