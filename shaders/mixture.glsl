// Multiple scattering as a mixture of Gaussians (docs/methods/mixture.md): R_d is a positive
// mixture of 3-D Gaussians, each octave of which is a blur of the light map times an expectation
// over depth. One tap a level gives both. CPU twin: cpu/shade/mixture.rs.

// Levels that read three moments, after them levels that read the fourth, too, and again three.
layout(constant_id = 1) const int FINE = 9;
layout(constant_id = 2) const int FOUR = 0;
layout(constant_id = 3) const int COARSE = 0;
// Then levels blended from three moments and a volume, and levels that read a volume alone.
layout(constant_id = 4) const int BLENDED = 0;
layout(constant_id = 5) const int ALONE = 0;

// Least and largest slope tan^2 of the receiver that the depth spread within a kernel is held
// to: a facing surface still curves; and what lies below the kernel of a steep receiver, or of one
// in shadow, is mostly other surfaces, which are not as steep. With three moments 40 in place of 6
// gains on a sphere (rr 0.010 for 0.014), and loses on the statue from every side (0.107 for 0.098).
const float SLOPE_MIN = 0.03;
const float SLOPE_MAX = 6.0;

// Half of minus the excess kurtosis of a level's kernel: nine binomial weights have fourth cumulant
// -1 and variance 2, what halves before and the tap after them -0.04 and 0.42, so 1.04 / 2.42^2 =
// 0.178. It is not the surface's: a slope shows it in its depths, and would be taken for two surfaces
// (a plane at 60 degrees comes out 1.7 % too dark). All of it serves the plane best, none the sphere.
const float KERNEL = 0.089;

// Depth below a level's kernel, in units of the half depth range: mean, variance and third
// central moment. The floor of the variance is what float32 leaves of m2 - m1^2.
struct Spread {
    float m1;
    float m2;
    float v;
    float c3;
};

Spread spread(vec4 m) {
    float i = 1.0 / max(m.x, 1e-6);
    Spread d;
    d.m1 = m.y * i;
    d.m2 = m.z * i;
    d.v = max(d.m2 - d.m1 * d.m1, 1.2e-7 * (d.m1 * d.m1 + 1e-3));
    d.c3 = m.w * i - d.m1 * (d.m2 + 2.0 * d.v);
    return d;
}

// The expectation of exp(-(z - z_p)^2 / (2 s^2)) / s over two Gaussians of the common variance
// `var`, which have the mean, the variance and the third moment of `d`. Where var = v they
// are one. `s2` is s^2.
float expectation(Spread d, float z_p, float var, float s2) {
    float y = max(d.v - var, 0.0);
    // Half of the distance's skew, q = c3 / 2y, and half of their distance.
    float q = d.c3 * y / (2.0 * (y * y + 1e-12 * s2 * s2));
    float apart = sqrt(q * q + y + 1e-30);
    float c = d.m1 - z_p + q;
    float g = 1.0 / (s2 + var);
    float k = -0.5 * LOG2_E * g;
    float far = exp2(k * (c + apart) * (c + apart));
    float near = exp2(k * (c - apart) * (c - apart));
    return 0.5 * sqrt(g) * (far + near + q / apart * (near - far));
}

// The common variance of the two Gaussians that have all four moments, `m4` being the fourth
// about 0: v (1 - Y) with 2 Y^3 + kappa Y - gamma^2 = 0. Two steps of Halley's from the guess are
// within 3e-5 of the root everywhere (tests/mixture.rs). One step, within 0.026, would do for Y but
// not for 1 - Y: where two surfaces lie far apart each is far thinner than their distance, and bands
// showed. Where float32 cannot carry the fourth moment it fades to `fallback`.
float common_variance(Spread d, float m4, float fallback) {
    float square = d.m1 * d.m1;
    float c4 = m4 - d.m1 * (4.0 * d.c3 + d.m1 * (6.0 * d.v + square));
    float v2 = d.v * d.v;
    float gamma2 = d.c3 * d.c3 / (v2 * d.v);
    float kappa = c4 / v2 - 3.0 + KERNEL * fallback * fallback / v2;
    float y = min(sqrt(0.5 * (max(-kappa, 0.0) + 0.8 * sqrt(gamma2))), 1.0);
    [[unroll]] for (int step = 0; step < 2; ++step) {
        float f = y * (2.0 * y * y + kappa) - gamma2;
        float df = 6.0 * y * y + kappa;
        y = clamp(y - f * df / (df * df - 6.0 * y * f + 1e-20), 0.0, 1.0);
    }
    float rho = v2 / (4.8e-7 * (square * (square + 6.0 * d.v) + 3.0 * v2));
    return mix(fallback, d.v * (1.0 - y), clamp(0.25 * (rho - 1.0), 0.0, 1.0));
}

// Of tap `i`, from a receiver at texel `st` of the map and depth `z_p`: the mean weight below the
// kernel, and the expectation over its depths.
vec2 tap_three(int i, vec2 st, float z_p, float slope) {
    vec4 place = frame.level_places[i];
    float s2 = frame.level_weights[i].w;
    vec4 m = FETCH_LINEAR(smoothed, st * place.x + place.yz, frame.map.yz);
    Spread d = spread(m);
    return vec2(m.x, place.w * expectation(d, z_p, min(d.v, slope * s2), s2));
}

#if defined(FOURTH)
vec2 tap_four(int i, vec2 st, float z_p, float slope) {
    vec4 place = frame.level_places[i];
    float s2 = frame.level_weights[i].w;
    vec2 at = st * place.x + place.yz;
    vec4 m = FETCH_LINEAR(smoothed, at, frame.map.yz);
    float m4 = FETCH_LINEAR(smoothed_fourth, at, frame.map.yz).x / max(m.x, 1e-6);
    Spread d = spread(m);
    float var = common_variance(d, m4, min(d.v, slope * s2));
    return vec2(m.x, place.w * expectation(d, z_p, var, s2));
}
#endif

// Keeps of the light at the finer level, `finer`, what Taps::kept of scene/plan.rs says: not of what lay
// below its kernel, where less lies below this one, which reaches beyond the object.
vec2 keep(vec2 tap, vec2 finer) {
    float least = frame.map.w * finer.y * min(tap.x, finer.x);
    return vec2(tap.x, max(tap.y, least / max(tap.x, 1e-6)));
}

#if defined(VOLUMES)
// The variance of depth, over s^2, from which on a blended level believes its volume, and from which on it
// believes nothing else: up to the first there is one surface, which moments describe without the ripple
// of a trilinear tap.
const float BLEND_FROM = 0.5;
const float BLEND_TO = 2.0;

// The light at level `i`, that is, m0 E, at texel `st` and a depth of st.z texels.
float tap_volume(int i, vec3 st) {
    vec4 place = frame.volume_places[i];
    return FETCH_VOLUME(volumes, st * place.w + place.xyz, frame.volume_scale.xyz);
}

// As tap_three, but with what lies below the receiver from the volume where it is several surfaces.
vec2 tap_blended(int i, vec3 st, float z_p, float slope, vec2 finer) {
    vec4 place = frame.level_places[i];
    float s2 = frame.level_weights[i].w;
    vec4 m = FETCH_LINEAR(smoothed, st.xy * place.x + place.yz, frame.map.yz);
    Spread d = spread(m);
    vec2 tap = keep(vec2(m.x, place.w * expectation(d, z_p, min(d.v, slope * s2), s2)), finer);
    float light = tap_volume(i, st) / max(m.x, 1e-6);
    return vec2(tap.x, mix(tap.y, light, smoothstep(BLEND_FROM * s2, BLEND_TO * s2, d.v)));
}
#endif

vec3 multiple_scattering(vec3 p, vec3 n, float lit) {
    vec3 q = to_light_space(p);
    vec2 st = q.xy * frame.light_scale.y;
    float cos_i = dot(n, frame.light_z.xyz);
    float cos2 = max(cos_i * cos_i, 1e-6);
    float slope = clamp((1.0 - cos2) / cos2, SLOPE_MIN, SLOPE_MAX);

    vec3 sum = vec3(0.0);
    vec2 light = vec2(0.0);
    [[unroll]] for (int i = 0; i < FINE; ++i) {
        light = keep(tap_three(i, st, q.z, slope), light);
        sum += frame.level_weights[i].rgb * (light.x * light.y);
    }
#if defined(FOURTH)
    [[unroll]] for (int i = FINE; i < FINE + FOUR; ++i) {
        light = keep(tap_four(i, st, q.z, slope), light);
        sum += frame.level_weights[i].rgb * (light.x * light.y);
    }
    [[unroll]] for (int i = FINE + FOUR; i < FINE + FOUR + COARSE; ++i) {
        light = keep(tap_three(i, st, q.z, slope), light);
        sum += frame.level_weights[i].rgb * (light.x * light.y);
    }
#endif
#if defined(VOLUMES)
    vec3 at = vec3(st, q.z * frame.volume_scale.w);
    const int blended = FINE + FOUR + COARSE;
    [[unroll]] for (int i = blended; i < blended + BLENDED; ++i) {
        light = tap_blended(i, at, q.z, slope, light);
        sum += frame.level_weights[i].rgb * (light.x * light.y);
    }
    [[unroll]] for (int i = blended + BLENDED; i < blended + BLENDED + ALONE; ++i) {
        sum += frame.level_weights[i].rgb * tap_volume(i, at);
    }
#endif
    return frame.irradiance.rgb * sum;
}
