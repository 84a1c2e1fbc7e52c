#version 460
// The panel's colours: those of the vertices times those of a texture, both encoded as sRGB and premultiplied.
// CPU twin: cpu/compose.rs.
#include "display.glsl"
#include "fetch.glsl"

layout(location = 0) in vec4 in_color;
layout(location = 1) in vec2 in_place;
layout(binding = 2) uniform sampler2D image;
layout(location = 0) out vec4 out_window;

void main() {
    vec2 size = vec2(textureSize(image, 0));
    // What is of one colour stands at the corner of a texture, and a tap must not reach beyond.
    vec2 at = clamp(in_place * size, vec2(0.5), size - 0.5);
    vec4 color = in_color * FETCH_LINEAR_LEVEL(image, at, 1.0 / size, 0.0);
    // Letters are premultiplied as they are encoded. Decoded so, they keep their weight on the panel's dark ground.
    out_window = vec4(ENCODES ? decode_srgb(color.rgb) : color.rgb, color.a);
}
