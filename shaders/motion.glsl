// What the view pass asks of the frame before this one, for live display. Mirrored by `Reprojection` of frame/uniforms.rs.
layout(set = 0, binding = 1, std140) uniform Before {
    mat4 now;      // scene to clip space of the camera, without jitter
    mat4 before;   // the same of the frame before
    vec4 picture;  // its columns and rows in pixels
} reprojection;
