#version 460
// The view pass: the G-buffer. CPU twin: cpu/view.rs.
#include "shared.glsl"

layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
layout(location = 0) out vec3 out_normal;
#ifdef MOTION
// Where the vertex was in the frame before.
#include "motion.glsl"
layout(location = 2) in vec3 in_before;
// Clip coordinates x, y and w.
layout(location = 1) out vec3 out_now;
layout(location = 2) out vec3 out_before;
#endif

// The back faces are drawn by the same shader in another pipeline, and the distance between
// the two depths is a thickness: the arithmetic must not differ.
invariant gl_Position;

void main() {
    gl_Position = frame.view_proj * vec4(in_position, 1.0);
    out_normal = in_normal;
#ifdef MOTION
    out_now = (reprojection.now * vec4(in_position, 1.0)).xyw;
    out_before = (reprojection.before * vec4(in_before, 1.0)).xyw;
#endif
}
