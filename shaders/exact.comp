#version 460
// Multiple scattering by the sum over every texel of the light map (DESIGN, the identity
// everything rests on): M = E0 sum a w R_d(|p - x|). One dispatch adds a band of rows.
// CPU twin: cpu/shade/.
#include "shared.glsl"
#include "fetch.glsl"
#include "fresnel.glsl"
#include "dipole.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 1) uniform sampler2D view_depth;
layout(binding = 2) uniform sampler2D view_normal;
layout(binding = 3) uniform sampler2D moments;
layout(binding = 4, rgba32f) uniform image2D radiance;

layout(push_constant) uniform Band {
    ivec2 columns;  // first column of the picture, and one past the last
    ivec2 lines;    // first line of the picture, and one past the last
    ivec2 rows;     // first row of the light map, and one past the last
} band;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(band.columns.x, band.lines.x);
    if (pixel.x >= band.columns.y || pixel.y >= band.lines.y) return;
    COUNT_AS(TERM_MULTIPLE);
    float depth = FETCH_TEXEL(view_depth, pixel).x;
    if (depth >= 1.0) {
        STORE_COUNTS(pixel, band.rows.x > 0);
        return;
    }

    vec3 p = position(vec2(pixel) + 0.5, depth);
    vec3 n = decode_normal(FETCH_TEXEL(view_normal, pixel).xy);
    vec3 q = to_light_space(p);
    int columns = int(frame.map.x);

    vec3 wo = normalize(frame.eye.xyz - p);
    vec3 scale = leaving(n, wo, frame.sigma_tr.w)
               * frame.irradiance.rgb * frame.irradiance.w;
    vec4 value = FETCH_IMAGE(radiance, pixel);
    for (int j = band.rows.x; j < band.rows.y; ++j) {
        float dv = (float(j) + 0.5) * frame.light_scale.x - q.y;
        // A row is summed on its own: a small term never meets the whole sum, and the result
        // does not depend on how the rows are dealt out to bands.
        vec3 row = vec3(0.0);
        for (int i = 0; i < columns; ++i) {
            vec4 m = FETCH_TEXEL(moments, ivec2(i, j));
            float du = (float(i) + 0.5) * frame.light_scale.x - q.x;
            float dz = (m.y / max(m.x, 1e-20) - q.z) * frame.light_scale.z;
            row += m.x * r_d(du * du + dv * dv + dz * dz);
        }
        value.rgb += scale * row;
    }
    imageStore(radiance, pixel, value);
    STORE_COUNTS(pixel, band.rows.x > 0);
}
