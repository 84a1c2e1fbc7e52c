// Fresnel's equations for a smooth dielectric.

// Reflectance for unpolarised light that arrives from outside at cosine `cos_i`.
float fresnel_reflectance(float cos_i, float eta) {
    cos_i = clamp(cos_i, 0.0, 1.0);
    float cos_t = sqrt(max(0.0, 1.0 - (1.0 - cos_i * cos_i) / (eta * eta)));
    // The denominators vanish for eta = 1 at cos_i = 0, and with them the numerators.
    float r_s = (cos_i - eta * cos_t) / max(cos_i + eta * cos_t, 1e-7);
    float r_p = (eta * cos_i - cos_t) / max(eta * cos_i + cos_t, 1e-7);
    return 0.5 * (r_s * r_s + r_p * r_p);
}

float fresnel_transmittance(float cos_i, float eta) {
    return 1.0 - fresnel_reflectance(cos_i, eta);
}

// Interpolated normals may turn away from the camera where the triangle does not. How grazing
// may light leave? The clamp touches the outer 2 % of a sphere's radius, and spares it the
// black rim that Ft(0) = 0 would draw.
const float MIN_COS_OUT = 0.2;

// Radiance towards `wo` of one unit of radiant exitance below the boundary: Ft / pi.
float leaving(vec3 n, vec3 wo, float eta) {
    return fresnel_transmittance(max(dot(n, wo), MIN_COS_OUT), eta) / PI;
}
