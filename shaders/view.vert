#version 460
// The view pass: the G-buffer. CPU twin: cpu/view.rs.
#include "shared.glsl"

layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
layout(location = 0) out vec3 out_normal;

// The back faces are drawn by the same shader in another pipeline, and the distance between
// the two depths is a thickness: the arithmetic must not differ.
invariant gl_Position;

void main() {
    gl_Position = frame.view_proj * vec4(in_position, 1.0);
    out_normal = in_normal;
}
