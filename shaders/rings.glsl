// Multiple scattering by square rings (Bouthors et al. 2007, section 3), as published: the
// light on a ring is the difference of two MIP levels of the light map, its share at the depth
// of the receiver is Chebyshev's bound, and R_d is taken at the ring's radius.
// CPU twin: cpu/shade/rings.rs.

// Levels read: the innermost square, and the rings around it.
layout(constant_id = 1) const int RINGS = 8;

// Mean distance of a square's points from its middle, in half sides, and of a ring's between
// squares of half sides 1/2 and 1: (4 D - D/2) / 3, D = (sqrt 2 + asinh 1) / 3.
const float SQUARE_RADIUS = 0.76519572;
const float RING_RADIUS = 0.89272834;

// Least variance of depth, in texels^2: what a slope of 45 degrees has within a texel, and more
// with bilinear taps (Donnelly and Lauritzen 2006, section 5, bound it likewise).
const float VARIANCE_MIN = 0.25;

// Irradiance through a level's square at the depth `z` of the receiver: weight times the share
// that Chebyshev's inequality leaves at least as deep.
float lit_share(vec4 m, float z, float least) {
    float i = 1.0 / max(m.x, 1e-6);
    float mean = m.y * i;
    float variance = max(m.z * i - mean * mean, least);
    float behind = max(z - mean, 0.0);
    return m.x * variance / (variance + behind * behind);
}

vec3 multiple_scattering(vec3 p, vec3 n, float lit) {
    vec3 q = to_light_space(p);
    vec2 st = q.xy * frame.light_scale.y;
    float texel = frame.light_scale.x * frame.light_scale.w;
    float least = VARIANCE_MIN * texel * texel;

    // Of the innermost square, in texels.
    float inner = lit_share(FETCH_LINEAR(moments, st, frame.map.yz), q.z, least);
    float radius = 0.5 * SQUARE_RADIUS * frame.light_scale.x;
    vec3 sum = inner * r_d(radius * radius);
    float area = 1.0;
    for (int k = 1; k < RINGS; ++k) {
        st *= 0.5;
        vec2 unit = 1.0 / vec2(textureSize(boxes, k - 1));
        area *= 4.0;
        float outer = area * lit_share(FETCH_LINEAR_LEVEL(boxes, st, unit, float(k - 1)), q.z, least);
        radius = 0.5 * RING_RADIUS * frame.light_scale.x * sqrt(area);
        sum += max(outer - inner, 0.0) * r_d(radius * radius);
        inner = outer;
    }
    return frame.irradiance.rgb * frame.irradiance.w * sum;
}
