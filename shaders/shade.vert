#version 460
// One triangle over the whole screen, at the far plane: with the depth comparison
// GREATER it shades exactly the pixels that the view pass covered, and the depth test
// skips the others before any of their work.

void main() {
    vec2 corner = vec2((gl_VertexIndex << 1) & 2, gl_VertexIndex & 2);
    gl_Position = vec4(2.0 * corner - 1.0, 1.0, 1.0);
}
