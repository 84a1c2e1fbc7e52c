#version 460
#extension GL_EXT_control_flow_attributes : require
// The shade pass: radiance towards the camera, once per visible pixel. CPU twin: cpu/shade/.
#include "shared.glsl"
#include "fetch.glsl"
#include "fresnel.glsl"
#include "dipole.glsl"
#include "specular.glsl"

layout(input_attachment_index = 0, binding = 1) uniform subpassInput view_depth;
layout(input_attachment_index = 1, binding = 2) uniform subpassInput view_normal;
#if defined(SINGLE)
layout(input_attachment_index = 2, binding = 3) uniform subpassInput back_depth;
layout(input_attachment_index = 3, binding = 6) uniform subpassInput back_normal;
layout(binding = 7) uniform sampler2D exits;
#endif
layout(binding = 4) uniform sampler2D moments;
layout(binding = 5) uniform sampler2DShadow light_depth;
#if defined(METHOD_SAMPLES)
layout(binding = 8) uniform sampler2D blue_noise;
#elif defined(METHOD_RINGS)
layout(binding = 8) uniform sampler2D boxes;
#elif defined(METHOD_MIXTURE)
layout(binding = 8) uniform sampler2D smoothed;
#if defined(FOURTH)
layout(binding = 9) uniform sampler2D smoothed_fourth;
#endif
#if defined(VOLUMES)
layout(binding = 10) uniform sampler3D volumes;
#endif
#elif defined(METHOD_HALF)
layout(binding = 8) uniform sampler2D half_radiance;
#endif

// Before any work: pixels that nothing covers must cost nothing.
layout(early_fragment_tests) in;

layout(location = 0) out vec4 out_radiance;

layout(constant_id = 0) const bool SPECULAR = true;
// Whether this is shaded at half size: the fourth component is then the distance along the optical axis, by which
// surfaces are told apart, in place of coverage.
layout(constant_id = 7) const bool HALVED = false;

#if defined(METHOD_BRDF)
const bool NEEDS_VISIBILITY = true;
#else
const bool NEEDS_VISIBILITY = SPECULAR;
#endif

// Share of the light that reaches `p`, by one gather that compares 2x2 texels. It is weighted
// here and not by the sampler, since D32 need not be filterable. The point is
// moved along its normal by enough to clear the surface within the tap: half a texel, and
// at grazing light the diagonal of the tap.
float visibility(vec3 p, vec3 n) {
    float cos_i = -dot(n, frame.light_z.xyz);
    if (cos_i <= 0.0) return 0.0;
    float sin_i = sqrt(max(0.0, 1.0 - cos_i * cos_i));
    vec3 q = to_light_space(p + n * (frame.light_scale.x * (0.5 + 1.5 * sin_i)));
    int size = textureSize(light_depth, 0).x;
    vec2 st = q.xy * frame.light_scale.y - 0.5;
    vec2 f = fract(st);
    // At the corner that the four texels share: the sampler's fixed point must not choose others.
    vec4 lit = FETCH_GATHER_COMPARE(light_depth, st - f + 1.0, size, to_light_depth(q.z));
    return mix(mix(lit.w, lit.z, f.x), mix(lit.x, lit.y, f.x), f.y);
}

#if defined(FLOOR)
#include "floor.glsl"
#elif defined(METHOD_HALF)
#include "half.glsl"
#else
#include "multiple.glsl"
#if defined(SINGLE)
#include "single.glsl"
#endif
#endif

void main() {
    float depth = READ_INPUT(view_depth).x;
    vec3 p = position(gl_FragCoord.xy, depth);
    vec3 n = decode_normal(READ_INPUT(view_normal).xy);
    vec3 wo = normalize(frame.eye.xyz - p);

    float lit = 1.0;
    if (NEEDS_VISIBILITY) lit = visibility(p, n);
#if defined(FLOOR)
    vec4 sum = multiple_reads(to_light_space(p));
#if defined(SINGLE)
    sum += single_reads(to_light_space(p), n, wo);
#endif
    out_radiance = 1e-3 * sum + lit;
#else
    COUNT_AS(TERM_MULTIPLE);
#if defined(METHOD_HALF)
    vec3 radiance = leaving(n, wo, frame.sigma_tr.w) * scattered(depth, n);
#else
    vec3 radiance = leaving(n, wo, frame.sigma_tr.w) * multiple_scattering(p, n, lit);
#endif
#if defined(SINGLE)
    COUNT_AS(TERM_SINGLE);
    radiance += single_scattering(p, depth, n, wo);
#endif
    COUNT_AS(TERM_OTHER);
    // What of it gets out changes within a pixel where the surface turns away: a matter of the picture's own size.
    if (HALVED) radiance /= leaving(n, wo, frame.sigma_tr.w);
    if (SPECULAR) {
        vec3 wi = -frame.light_z.xyz;
        float value = ggx(n, wo, wi, frame.z_r.w, frame.sigma_tr.w);
        radiance += frame.irradiance.rgb * value * max(0.0, dot(n, wi)) * lit;
    }
    out_radiance = vec4(radiance, HALVED ? axial(depth) : 1.0);
    STORE_COUNTS(ivec2(gl_FragCoord.xy), false);
#endif
}
