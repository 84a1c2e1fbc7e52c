#version 460
#include "shared.glsl"

layout(location = 0) in vec3 in_normal;
layout(location = 0) out vec2 out_normal;

void main() {
    vec3 n = normalize(in_normal);
    out_normal = encode_normal(gl_FrontFacing ? n : -n);
}
