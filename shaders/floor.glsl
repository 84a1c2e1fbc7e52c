// What the shade pass reads, and next to nothing else: the same textures as often, in loops of the same form, at
// addresses that lie as the real ones do. What the pass takes beyond the time of this is arithmetic: `marmor bench`
// reports it as a multiple. The ledger's test holds the reads to those of the pass.

#if defined(METHOD_SAMPLES)
layout(constant_id = 1) const int SAMPLES = 30;
#elif defined(METHOD_RINGS)
layout(constant_id = 1) const int RINGS = 8;
#elif defined(METHOD_MIXTURE)
layout(constant_id = 1) const int FINE = 9;
layout(constant_id = 2) const int FOUR = 0;
layout(constant_id = 3) const int COARSE = 0;
layout(constant_id = 4) const int BLENDED = 0;
layout(constant_id = 5) const int ALONE = 0;
#endif
layout(constant_id = 6) const int STEPS = 8;

#if defined(METHOD_MIXTURE)
vec2 level_place(int i, vec2 st) {
    vec4 place = frame.level_places[i];
    return st * place.x + place.yz;
}
#endif

vec4 multiple_reads(vec3 q) {
    vec2 st = q.xy * frame.light_scale.y;
    vec4 sum = vec4(0.0);
#if defined(METHOD_SAMPLES)
    vec2 turn = FETCH_TEXEL(blue_noise, ivec2(gl_FragCoord.xy) & 63).xy * 2.0 - 1.0;
    float size = float(textureSize(moments, 0).x);
    sum += FETCH_NEAREST(moments, st, size);
    // As far out as the widest profile reaches, as in a disc.
    float reach = 3.0 / frame.sigma_tr.x * frame.light_scale.y / sqrt(float(SAMPLES));
    const mat2 step = mat2(-0.7374, 0.6755, -0.6755, -0.7374);
    for (int j = 0; 6 * j < SAMPLES; ++j, turn = step * turn) {
        [[unroll]] for (int t = 0; t < 6; ++t) {
            if (6 * j + t >= SAMPLES) break;
            vec2 at = st + turn * (reach * sqrt(float(6 * j + t)));
            sum += FETCH_NEAREST(moments, clamp(floor(at) + 0.5, -0.5, frame.map.x + 0.5), size);
        }
    }
#elif defined(METHOD_RINGS)
    sum += FETCH_LINEAR(moments, st, frame.map.yz);
    [[unroll]] for (int k = 1; k < RINGS; ++k) {
        st *= 0.5;
        sum += FETCH_LINEAR_LEVEL(boxes, st, frame.rings[k].ww, float(k - 1));
    }
#elif defined(METHOD_MIXTURE)
    [[unroll]] for (int i = 0; i < FINE; ++i) sum += FETCH_LINEAR(smoothed, level_place(i, st), frame.map.yz);
#if defined(FOURTH)
    [[unroll]] for (int i = FINE; i < FINE + FOUR; ++i) {
        sum += FETCH_LINEAR(smoothed, level_place(i, st), frame.map.yz);
        sum += FETCH_LINEAR(smoothed_fourth, level_place(i, st), frame.map.yz);
    }
    [[unroll]] for (int i = FINE + FOUR; i < FINE + FOUR + COARSE; ++i) {
        sum += FETCH_LINEAR(smoothed, level_place(i, st), frame.map.yz);
    }
#endif
#if defined(VOLUMES)
    vec3 at = vec3(st, q.z * frame.volume_scale.w);
    const int blended = FINE + FOUR + COARSE;
    [[unroll]] for (int i = blended; i < blended + BLENDED; ++i) {
        vec4 place = frame.volume_places[i];
        sum += FETCH_LINEAR(smoothed, level_place(i, st), frame.map.yz);
        sum.x += FETCH_VOLUME(volumes, at * place.w + place.xyz, frame.volume_scale.xyz);
    }
    [[unroll]] for (int i = blended + BLENDED; i < blended + BLENDED + ALONE; ++i) {
        vec4 place = frame.volume_places[i];
        sum.x += FETCH_VOLUME(volumes, at * place.w + place.xyz, frame.volume_scale.xyz);
    }
#endif
#elif defined(METHOD_HALF)
    vec2 at = 0.5 * gl_FragCoord.xy - fract(0.5 * gl_FragCoord.xy - 0.5);
    [[unroll]] for (int k = 0; k < 4; ++k) {
        sum += FETCH_NEAREST(half_radiance, at + vec2(k & 1, k >> 1), vec2(textureSize(half_radiance, 0)));
    }
#endif
    return sum;
}

#if defined(SINGLE)
vec4 single_reads(vec3 q, vec3 n, vec3 wo) {
    vec4 sum = vec4(READ_INPUT(back_depth).x);
    sum.xy += READ_INPUT(back_normal).xy;
    vec3 across = (wo - n * dot(n, wo)) / frame.sigma_tr.w;
    vec3 inward = -across - n * sqrt(max(0.0, 1.0 - dot(across, across)));
    vec2 dq = vec2(dot(frame.light_u.xyz, inward), dot(frame.light_v.xyz, inward));
    [[unroll]] for (int i = 1; i <= STEPS; ++i) {
        float x = frame.march.y * float(i * i) / float(STEPS * STEPS);
        vec2 st = clamp((q.xy + x * dq) * frame.light_scale.y, -0.5, frame.map.x + 0.5);
#if defined(EXITS_DEPTH)
        sum += FETCH_NEAREST(exits, st, frame.map.xx);
#else
        sum += FETCH_FILTERED(exits, st, frame.map.yz);
#endif
    }
    return sum;
}
#endif
