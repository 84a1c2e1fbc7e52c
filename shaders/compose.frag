#version 460
// The compose pass: the picture in its place in the window, over the backdrop. CPU twin: cpu/compose.rs.
#include "display.glsl"
#include "fetch.glsl"

layout(binding = 0) uniform Place {
    vec4 place;    // columns and rows of the window that the picture fills: corner, size
    vec4 backdrop; // linear rgb
};
layout(binding = 1) uniform sampler2D picture; // encoded as sRGB, straight alpha
layout(location = 0) out vec4 out_window;

void main() {
    vec2 size = vec2(textureSize(picture, 0));
    vec2 inside = gl_FragCoord.xy - place.xy;
    vec3 color = backdrop.rgb;
    if (all(greaterThan(inside, vec2(0.0))) && all(lessThan(inside, place.zw))) {
        // A picture of fewer pixels than its place is read between them, but not beyond its edge.
        vec2 at = clamp(inside * size / place.zw, vec2(0.5), size - 0.5);
        vec4 value = FETCH_LINEAR_LEVEL(picture, at, 1.0 / size, 0.0);
        color = mix(color, decode_srgb(value.rgb), value.a);
    }
    out_window = vec4(stored(color), 1.0);
}
