// Both terms of scattering, shaded once for four pixels. CPU twin: cpu/shade/half.rs.

// How far a point may lie off the plane of the pixel's own surface and still count half, squared, in pixels: some
// curvature is no other surface. Half and four times that give the same error on the statue to a thirtieth.
const float OFF_PLANE = 2.0;

// Of the four nearest pixels of the half, whose fourth component is their distance along the optical axis, the bilinear mean
// over those that see the same surface. A tap between them, divided by its coverage, would bleed across every edge
// within the object, from lit surfaces to those in their shadow.
vec3 scattered(float depth, vec3 n) {
    vec2 size = vec2(textureSize(half_radiance, 0));
    // Pixel (i, j) of the half has its centre where four pixels meet, at (2 i + 1, 2 j + 1).
    vec2 st = 0.5 * gl_FragCoord.xy;
    vec2 f = fract(st - 0.5);
    float own = axial(depth);
    vec3 p = view_ray(gl_FragCoord.xy) * own;
    float scale = 1.0 / (own * own * dot(frame.ray_x.xyz, frame.ray_x.xyz));
    vec4 sum = vec4(0.0);
    [[unroll]] for (int k = 0; k < 4; ++k) {
        vec2 at = vec2(k & 1, k >> 1);
        vec2 share = mix(1.0 - f, f, at);
        at += st - f;
        vec4 tap = FETCH_NEAREST(half_radiance, at, size);
        float off = dot(n, view_ray(2.0 * at) * tap.a - p);
        float like = OFF_PLANE + off * off * scale;
        // Nothing is seen where the distance is 0.
        float weight = tap.a > 0.0 ? share.x * share.y / (like * like) : 0.0;
        sum += weight * vec4(tap.rgb, 1.0);
    }
    return sum.rgb / max(sum.a, 1e-30);
}
