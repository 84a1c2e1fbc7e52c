// Multiple scattering by square rings (Bouthors et al. 2007, section 3), as published: the
// light on a ring is the difference of two MIP levels of the light map, its share at the depth
// of the receiver is Chebyshev's bound, and R_d is taken at the ring's radius.
// CPU twin: cpu/shade/rings.rs.

// Levels read: the innermost square, and the rings around it.
layout(constant_id = 1) const int RINGS = 8;

// Least variance of depth, in texels^2: what a slope of 45 degrees has within a texel, and more
// with bilinear taps (Donnelly and Lauritzen 2006, section 5, bound it likewise).
const float VARIANCE_MIN = 0.25;

// Irradiance through a level's square at the depth `z` of the receiver: weight times the share
// that Chebyshev's inequality leaves at least as deep, variance / (variance + behind^2). Both are taken times the
// weight squared, which leaves one division.
float lit_share(vec4 m, float z, float least) {
    float w = max(m.x, 1e-6);
    float variance = max(m.z * w - m.y * m.y, least * (w * w));
    float behind = max(z * w - m.y, 0.0);
    return m.x * variance / (variance + behind * behind);
}

vec3 multiple_scattering(vec3 p, vec3 n, float lit) {
    vec3 q = to_light_space(p);
    vec2 st = q.xy * frame.light_scale.y;
    float texel = frame.light_scale.x * frame.light_scale.w;
    float least = VARIANCE_MIN * texel * texel;

    // Of the innermost square, in texels. R_d at a ring's radius is the same in every pixel, and comes with the frame.
    float inner = lit_share(FETCH_LINEAR(moments, st, frame.map.yz), q.z, least);
    vec3 sum = inner * frame.rings[0].rgb;
    float area = 1.0;
    [[unroll]] for (int k = 1; k < RINGS; ++k) {
        st *= 0.5;
        area *= 4.0;
        float outer = area * lit_share(FETCH_LINEAR_LEVEL(boxes, st, frame.rings[k].ww, float(k - 1)), q.z, least);
        sum += max(outer - inner, 0.0) * frame.rings[k].rgb;
        inner = outer;
    }
    return sum;
}
