// Multiple scattering: the radiant exitance M at a receiver. CPU twin: cpu/shade/.

#if defined(METHOD_SAMPLES)

// Samples a pixel.
layout(constant_id = 1) const int SAMPLES = 30;
// Side of the blue-noise tile.
const int BLUE_NOISE_SIZE = 64;

// y > 0 with y + ln y = b: a start within 2.8 %, then one iteration of Fritsch, Shafer & Crowley
// (1973), whose error is of fourth order: less than float32 can carry. CPU twin:
// optics/sampling/radius.rs.
float solve(float b) {
    float x = exp(min(b, 0.5));
    float y = b <= 0.5 ? x * (1.0 + 0.28 * x) / (1.0 + 1.28 * x)
                       : b - log(1.0 + b) + 0.7 / (1.0 + 0.04 * b);
    float z = b - log(y) - y;
    float q = 2.0 * (1.0 + y) * (1.0 + y + z * (2.0 / 3.0));
    return y + y * z * (q - z) / ((1.0 + y) * (q - 2.0 * z));
}

// What the three techniques of one depth gap T need at one receiver. CPU twin:
// RadiusSampler of optics/sampling/radius.rs.
struct Gap {
    vec3 share;   // share of the real source in Phi(T^2), the energy beyond the gap
    vec3 y_r;     // sigma_tr times the distance to the real source across the gap
    vec3 y_v;     // the same for the virtual source
    vec3 weight;  // what makes a density of `profile(rho^2 + T^2, y_r)`
};

Gap make_gap(float t) {
    vec3 d_r = sqrt(t * t + frame.z_r.rgb * frame.z_r.rgb);
    vec3 d_v = sqrt(t * t + frame.z_v.rgb * frame.z_v.rgb);
    Gap g;
    g.y_r = frame.sigma_tr.rgb * d_r;
    g.y_v = frame.sigma_tr.rgb * d_v;
    // Relative to e^-y_r, since the exponentials themselves underflow across a wide gap.
    vec3 phi_r = frame.z_r.rgb / d_r;
    vec3 phi_v = frame.z_v.rgb / d_v * exp(g.y_r - g.y_v);
    g.share = phi_r / (phi_r + phi_v);
    g.weight = 0.5 / PI / (phi_r + phi_v);
    return g;
}

// Squared radius within which lies the share `u` of the energy beyond the gap: the inverse
// of 1 - Phi(rho^2 + T^2) / Phi(T^2), in closed form but for `solve`.
float sample_radius2(Gap g, int c, float u) {
    bool real = u < g.share[c];
    float v = real ? u / g.share[c] : (u - g.share[c]) / (1.0 - g.share[c]);
    float y_t = real ? g.y_r[c] : g.y_v[c];
    // 1 - v is at least an ulp of the random number.
    float y = solve(y_t + log(y_t) - log(max(1.0 - v, 1.0 / 16777216.0)));
    float sigma = frame.sigma_tr[c];
    return max(0.0, (y - y_t) * (y + y_t)) / (sigma * sigma);
}

// E0 times the dipole integrated over the lit surface, by importance-sampled Monte Carlo
// (Bouthors et al. 2007, section 3).
//
// Sample i uses technique t = i mod 6: the radius follows the profile of channel t mod 3,
// across no gap for t < 3 and else across the gap to the lit surface. Radii are stratified
// within a technique, angles follow the golden ratio, and both are staggered by t / 6, which
// halves the error where techniques have much the same density.
vec3 multiple_scattering(vec3 p, vec3 n, float lit) {
    vec3 q = to_light_space(p);
    vec2 st = q.xy * frame.light_scale.y;
    vec2 size = vec2(textureSize(moments, 0));

    // The gap between the receiver and the lit surface above it.
    vec4 m = FETCH_NEAREST(moments, st, size);
    float gap = m.x > 0.0 ? max(0.0, (q.z - m.y / m.x) * frame.light_scale.z) : 0.0;
    Gap near = make_gap(0.0);
    Gap far = make_gap(gap);
    // The balance heuristic wants the densities times the samples of each technique.
    vec3 weight_near = near.weight * vec3(ivec3(SAMPLES + 5, SAMPLES + 4, SAMPLES + 3) / 6);
    vec3 weight_far = far.weight * vec3(ivec3(SAMPLES + 2, SAMPLES + 1, SAMPLES) / 6);

    vec2 blue = FETCH_TEXEL(blue_noise, ivec2(gl_FragCoord.xy) & (BLUE_NOISE_SIZE - 1)).xy;
    vec2 xi = fract(blue + frame.sequence.xy);
    // The angle of sample (j, t) is 2 pi (xi.y + j golden + t / 6): a rotation an iteration.
    vec2 turn = vec2(cos(2.0 * PI * xi.y), sin(2.0 * PI * xi.y));
    const float golden = 2.0 * PI * 0.61803398875;
    const mat2 step = mat2(cos(golden), sin(golden), -sin(golden), cos(golden));

    vec3 sum = vec3(0.0);
    for (int j = 0; 6 * j < SAMPLES; ++j, turn = step * turn) {
        [[unroll]] for (int t = 0; t < 6; ++t) {
            if (6 * j + t >= SAMPLES) break;
            float stagger = float(t) / 6.0;
            float u = (float(j) + fract(xi.x + stagger)) / float((SAMPLES + 5 - t) / 6);
            float c = cos(2.0 * PI * stagger), s = sin(2.0 * PI * stagger);
            vec2 direction = vec2(c * turn.x - s * turn.y, s * turn.x + c * turn.y);
            float rho2 = t < 3 ? sample_radius2(near, t, u) : sample_radius2(far, t - 3, u);
            vec2 at = st + sqrt(rho2) * frame.light_scale.y * direction;
            // At the texel's centre, lest the sampler's fixed point choose a neighbour.
            // A read beyond the map meets the zeros beside it, and none of the pyramid's levels.
            vec2 center = clamp(floor(at) + 0.5, -0.5, frame.map.x + 0.5);
            vec4 texel = FETCH_NEAREST(moments, center, size);
            // R_d is taken at the texel's centre, which makes the expectation exactly the
            // sum that `exact` computes. Where nothing is lit, the weight texel.x is 0.
            vec2 lateral = (center - st) * frame.light_scale.x;
            float depth = (texel.y / max(texel.x, 1e-20) - q.z) * frame.light_scale.z;
            vec3 value = texel.x * r_d(dot(lateral, lateral) + depth * depth);
            float pdf = dot(weight_near, profile(rho2, near.y_r))
                      + dot(weight_far, profile(rho2 + gap * gap, far.y_r));
            // Both underflow far away, the value first.
            sum += value / max(pdf, 1e-30);
        }
    }
    return frame.irradiance.rgb * sum;
}

#elif defined(METHOD_RINGS)
#include "rings.glsl"

#elif defined(METHOD_MIXTURE)
#include "mixture.glsl"

#elif defined(METHOD_BRDF)

// No transport: what enters leaves at the same point.
vec3 multiple_scattering(vec3 p, vec3 n, float lit) {
    float cos_i = max(0.0, -dot(n, frame.light_z.xyz));
    return frame.irradiance.rgb * cos_i * fresnel_transmittance(cos_i, frame.sigma_tr.w)
         * frame.r_tot.rgb * lit;
}

#else

vec3 multiple_scattering(vec3 p, vec3 n, float lit) {
    return vec3(0.0);
}

#endif
