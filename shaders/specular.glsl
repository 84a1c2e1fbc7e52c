// The reflection at the rough boundary: GGX with height-correlated Smith masking
// (Walter et al. 2007; Heitz 2014). CPU twin: optics/specular.rs.

// The BRDF's value, without the cosine; `alpha` is the roughness.
float ggx(vec3 n, vec3 wo, vec3 wi, float alpha, float eta) {
    float cos_o = dot(n, wo), cos_i = dot(n, wi);
    if (cos_o <= 0.0 || cos_i <= 0.0) return 0.0;
    vec3 h = normalize(wo + wi);
    float cos_h = dot(n, h);
    float a2 = alpha * alpha;
    float q = cos_h * cos_h * (a2 - 1.0) + 1.0;
    // Distribution a2 / (PI q^2) times visibility G2 / (4 cos_o cos_i), on one denominator.
    float g_o = cos_i * sqrt(a2 + (1.0 - a2) * cos_o * cos_o);
    float g_i = cos_o * sqrt(a2 + (1.0 - a2) * cos_i * cos_i);
    return 0.5 * a2 / (PI * q * q * (g_o + g_i)) * fresnel_reflectance(dot(wo, h), eta);
}
