// Single scattering (docs/methods/single.md): a march along the refracted view ray, each sample one
// fetch of the light map, each segment in closed form. CPU twins: cpu/shade/single.rs,
// optics/single.rs.

// Samples of the march.
layout(constant_id = 6) const int STEPS = 8;

// How much may the lit surface move, in steps, and still be one surface?
const float JUMP = 3.0;
// By how many texels must a point lie before the lit surface to be outside, for all that a texel knows?
const float CLEAR = 0.5;

// The unit direction in which the view ray goes on below the surface, by Snell's law.
vec3 refract_inward(vec3 wo, vec3 n, float eta) {
    vec3 across = (wo - n * dot(n, wo)) / eta;
    return -across - n * sqrt(max(0.0, 1.0 - dot(across, across)));
}

// Phase function of Henyey and Greenstein, of mean cosine `g`.
float henyey_greenstein(float cosine, float g) {
    float d = 1.0 + g * g - 2.0 * g * cosine;
    return (1.0 - g * g) / (4.0 * PI * d * sqrt(d));
}

// How far the refracted ray runs until it leaves the object, from the one back face that the
// pixel itself sees: to that face's plane, but at most twice as far as through the larger of two spheres, through the
// chord's ends with both normals or with the receiver's; and no less than if the face were parallel to the front, since an exit
// too near is black. NO_EXIT where there is no back face.
const float NO_EXIT = 1e30;

float exit_length(vec3 p, float depth, vec3 n_p, vec3 wo, vec3 inward) {
    float back = READ_INPUT(back_depth).x;
    vec3 n = -decode_normal(READ_INPUT(back_normal).xy);
    vec3 across = position(gl_FragCoord.xy, back) - p;
    float toward = dot(inward, n);
    float plane = toward > 1e-3 ? dot(across, n) / toward : NO_EXIT;
    float chord = length(across);
    // The way through a sphere of radius R is 2 R times the cosine below the surface.
    float cos_t = -dot(inward, n_p);
    vec3 turn = n - n_p;
    float radius = max(dot(across, turn) / max(dot(turn, turn), 1e-6), 0.0);
    float of_both = 2.0 * radius * cos_t;
    float cos_o = clamp(dot(n_p, wo), 0.05, 1.0);
    float of_one = chord * cos_t / cos_o;
    float parallel = chord * cos_o / cos_t;
    // Rounding must not make the march's steps vanish.
    float far = max(max(min(plane, 2.0 * max(of_both, of_one)), parallel), 1e-3 * frame.march.x);
    // An open sheet seen from behind is its own back face, and no way out.
    return back > depth && back < 1.0 ? far : NO_EXIT;
}

// ln of the growth from step to step for which `STEPS` steps, the first `first` long, reach `far`, or 0
// where equal steps are shorter: Newton's method, two steps of which are all that float32 carries.
float log_growth(float first, float far) {
    const float n = float(STEPS);
    float ratio = far / (n * first);
    if (STEPS < 2 || ratio <= 1.0) return 0.0;
    float target = log(ratio);
    // The lesser root of what the function is near 0 and far out. exp must not overflow; there the steps already grow by
    // whole mean free paths.
    const float a = (n * n - 1.0) / 12.0, b = (n - 1.0) / 2.0;
    float near = (sqrt(b * b + 2.0 * a * target) - b) / a;
    float u = min(min(near, (target + log(n)) / (n - 1.0)), 80.0 / n);
    [[unroll]] for (int i = 0; i < 2; ++i) {
        float up = exp(n * u) - 1.0, one = exp(u) - 1.0;
        float value = log(up / (n * one)) - target;
        float slope = n + n / up - 1.0 - 1.0 / one;
        u = max(u - value / slope, 1e-3);
    }
    return u;
}

// The lit surface over a point of the march, and what arrives from it.
struct Above {
    float w;       // coverage times transmittance; 0 where there is none
    float l;       // refracted path from the mean depth, mm
    float below;   // how far below the nearest surface under the tap, mm; negative above it
    vec3 arrives;  // mean of e^(-sigma_t l) over the surfaces under the tap
    bool edge;     // whether these are two
};

// Where the light meets nothing.
const Above NOTHING = Above(0.0, 0.0, 0.0, vec3(1.0), false);

// s' / s for light that arrives at the angle of which the weight `w` tells: see PathFit of
// optics/single.rs.
float path_factor(float w) {
    float x = sqrt(clamp(1.0 - w / frame.march.z, 0.0, 1.0));
    vec4 c = frame.path;
    return (1.0 - x) * (1.0 + x * (c.x + x * (c.y + x * (c.z + x * c.w))));
}

// Over the point `q`: mm from the map's corner, and depth in mm.
Above above(vec3 q, vec3 n) {
    // A read beyond the map meets the zeros beside it, and none of the pyramid's levels.
    vec2 st = clamp(q.xy * frame.light_scale.y, -0.5, frame.map.x + 0.5);
    vec3 rate = -LOG2_E * frame.sigma_t.rgb;
    Above a;
#if defined(EXITS_DEPTH)
    float depth = FETCH_NEAREST(exits, st, frame.map.xx).x;
    float cos_i = abs(dot(n, frame.light_z.xyz));
    float sin_t = (1.0 - cos_i * cos_i) / (frame.sigma_tr.w * frame.sigma_tr.w);
    float factor = cos_i / max(sqrt(1.0 - sin_t), 1e-7);
    if (frame.sigma_tr.w == 1.0) factor = 1.0;
    float s = q.z - (depth - 0.5) * 2.0 * LIGHT_DEPTH_MARGIN * frame.light_scale.z;
    a.w = depth < 1.0 ? fresnel_transmittance(cos_i, frame.sigma_tr.w) : 0.0;
    a.l = max(s, 0.0) * factor;
    a.below = s;
    a.arrives = exp2(rate * a.l);
    a.edge = false;
#else
    vec4 m = FETCH_FILTERED(exits, st, frame.map.yz);
    float i = 1.0 / max(m.x, 1e-6);
    float m1 = m.y * i, m2 = m.z * i;
    float v = max(m2 - m1 * m1, 0.0);
    float c3 = m.w * i - m1 * (m2 + 2.0 * v);
    float half_depth = frame.light_scale.z;
    float s = q.z - m1 * half_depth;
    a.w = m.x > 1e-6 ? m.x : 0.0;
    float factor = path_factor(a.w);
    // Depths too far apart for one slope are those of two surfaces: the points of variance v and
    // third moment c3 about their mean.
    a.edge = v > frame.march.w;
    float skew = a.edge ? c3 / v : 0.0;
    float apart = a.edge ? sqrt(skew * skew + 4.0 * v) : 0.0;
    float share = a.edge ? 0.5 + 0.5 * skew / apart : 1.0;
    float near = s - 0.5 * (skew - apart) * half_depth;
    float deep = s - 0.5 * (skew + apart) * half_depth;
    a.l = max(s, 0.0) * factor;
    a.below = near;
    a.arrives = mix(exp2(rate * (max(deep, 0.0) * factor)), exp2(rate * (max(near, 0.0) * factor)), share);
#endif
    if (a.w == 0.0) a = NOTHING;
    return a;
}

// The integral over a segment of length `dx`, along which the view ray keeps `kept` of what it has at
// its start. `mean_path` is 1 / sigma_t: a division costs four products here.
vec3 integrate(float dx, vec3 kept, vec3 mean_path, Above from, Above to) {
    vec3 b = frame.sigma_t.rgb * dx;
    vec3 by_b = mean_path * (1.0 / dx);
    // Closed: the surface is straight between the two.
    vec3 rise = b + frame.sigma_t.rgb * (to.l - from.l);
    // e^-rise as a ratio would overflow where the light comes nearer; its product with `arrives` is at hand.
    vec3 series = from.arrives * (1.0 - rise * (0.5 - rise * (1.0 / 6.0 - rise / 24.0)));
    vec3 ratio = (from.arrives - to.arrives * kept) / rise;
    vec3 closed = 0.5 * (from.w + to.w) * mix(ratio, series, lessThan(abs(rise), vec3(0.02)));
    // Open: it jumps, and what arrives is interpolated.
    vec3 few = 1.0 - b * (0.5 - b * (1.0 / 6.0 - b / 24.0));
    vec3 g0 = mix((1.0 - kept) * by_b, few, lessThan(b, vec3(0.02)));
    vec3 small = 0.5 - b * (1.0 / 3.0 - b * (0.125 - b * (1.0 / 30.0 - b / 144.0)));
    // (1 - e^-b (1 + b)) / b^2.
    vec3 g1 = mix((g0 - kept) * by_b, small, lessThan(b, vec3(0.1)));
    vec3 open = from.w * from.arrives * (g0 - g1) + to.w * to.arrives * g1;
    bool jumps = from.edge || to.edge || abs(to.l - from.l) > JUMP * dx;
    return dx * (jumps ? open : closed);
}

// The surface over the entry of the ray, from the samples `from` at depth `x` and `to`, `dx` further: on the
// line through the two, or, where the surface jumps between them, that of the first.
Above backwards(float x, float dx, Above from, Above to) {
    float rise = to.l - from.l;
    if (from.edge || to.edge || abs(rise) > JUMP * dx) return from;
    Above start = from;
    start.l = max(from.l - rise * x / dx, 0.0);
    start.arrives = exp2(-LOG2_E * start.l * frame.sigma_t.rgb);
    return start;
}

// Radiance that is scattered once towards the viewer.
vec3 single_scattering(vec3 p, float depth, vec3 n, vec3 wo) {
    float eta = frame.sigma_tr.w;
    vec3 sigma_t = frame.sigma_t.rgb;
    vec3 mean_path = 1.0 / sigma_t;
    vec3 inward = refract_inward(wo, n, eta);
    float exit = exit_length(p, depth, n, wo, inward);
    float far = min(exit, frame.march.y);
    float first = STEPS < 2 ? far : min(frame.march.x, far / float(STEPS));
    float growth = exp(log_growth(first, far));
    float clear = CLEAR * frame.light_scale.x;

    vec3 q = to_light_space(p) * vec3(1.0, 1.0, frame.light_scale.z);
    vec3 dq = vec3(dot(frame.light_u.xyz, inward), dot(frame.light_v.xyz, inward), dot(frame.light_z.xyz, inward));

    vec3 sum = vec3(0.0), slope = vec3(0.0), kept = vec3(1.0);
    Above from = NOTHING;
    float x = 0.0, dx = first;
    // Whether the ray is still inside. Loops run to their end, and add nothing once it is not.
    bool inside = true;
    [[unroll]] for (int i = 1; i <= STEPS; ++i) {
        Above to = above(q + (x + dx) * dq, n);
        // Where no column of the map holds anything, or the point lies before the lit surface by more than
        // half a texel, the ray is outside: it left on the way.
        bool empty = to.w <= 0.0 && from.w > 0.0;
        bool before = i > 1 && to.below < -clear && to.below < from.below;
        float share = before ? clamp((from.below + clear) / (from.below - to.below), 1e-3, 1.0) : 1.0;
        if (before) {
            // Through the lit surface itself.
            to.l = 0.0;
            to.arrives = vec3(1.0);
            to.edge = false;
        }
        if (empty) {
            to = from;
            share = 0.5;
        }
        float length = share * dx;
        // Nothing is read at the surface itself: the first segment begins where the second points to;
        // a lone one at the surface itself, if that may be lit.
        if (i == 1) from = to;
        if (STEPS == 1 && to.l <= JUMP * length) {
            from.l = 0.0;
            from.arrives = vec3(1.0);
        }
        vec3 loss = exp2(-LOG2_E * length * sigma_t);
        vec3 part = kept * integrate(length, loss, mean_path, from, to);
        if (STEPS > 1) {
            if (i == 1) part = vec3(0.0);
            if (i == 2) part += integrate(x, kept, mean_path, backwards(x, length, from, to), from);
        }
        if (inside) {
            sum += part;
            slope = sigma_t * (1.0 + (to.l - from.l) / length);
            kept *= loss;
            x += length;
            from = to;
        }
        inside = inside && share >= 1.0;
        dx *= growth;
    }
    // The tail, from the last sample to the exit: see optics/single.rs.
    float rest = exit - x;
    if (inside && rest > 0.0) {
        vec3 least = 0.5 * sigma_t;
        if (exit < NO_EXIT) least = min(least, sigma_t + log(max(from.arrives, 1e-37)) / rest);
        vec3 m = max(slope, least);
        vec3 b = m * rest;
        vec3 tail = mix((1.0 - exp2(-LOG2_E * b)) / m, rest * (1.0 - 0.5 * b), lessThan(abs(b), vec3(1e-3)));
        sum += from.w * kept * from.arrives * tail;
    }
    float phase = henyey_greenstein(-dot(frame.light_z.xyz, inward), frame.sigma_t.w);
    return frame.irradiance.rgb * frame.sigma_s.rgb * sum
         * (PI * leaving(n, wo, eta) * phase);
}
