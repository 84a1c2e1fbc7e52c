#version 460
// The panel's triangles. Vertices are read from buffers: nothing else draws what has colours of bytes.

// Of each vertex five words: position (points, from the window's upper left corner), place in the texture, in [0, 1],
// and rgba in bytes. Before the first, two words: 2 / columns and 2 / rows of the window, in points.
layout(binding = 0, std430) readonly buffer Vertices {
    uint words[];
};
layout(binding = 1, std430) readonly buffer Indices {
    uint indices[];
};
layout(location = 0) out vec4 out_color;
layout(location = 1) out vec2 out_place;

void main() {
    uint at = 2u + 5u * indices[gl_VertexIndex];
    vec2 position = uintBitsToFloat(uvec2(words[at], words[at + 1u]));
    out_place = uintBitsToFloat(uvec2(words[at + 2u], words[at + 3u]));
    out_color = unpackUnorm4x8(words[at + 4u]);
    vec2 scale = uintBitsToFloat(uvec2(words[0], words[1]));
    gl_Position = vec4(position * scale - 1.0, 0.0, 1.0);
}
