// Fresnel's equations for a smooth dielectric.

// Reflectance for unpolarised light that arrives from outside at cosine `cos_i`.
float fresnel_reflectance(float cos_i, float eta) {
    float c = clamp(cos_i, 0.0, 1.0);
    float e = eta * eta;
    // eta times the cosine inside: r_s = (c - g) / (c + g), r_p = (e c - g) / (e c + g), on one denominator.
    float g = sqrt(max(0.0, e - 1.0 + c * c));
    float s = c + g, p = e * c + g;
    float r_s = (c - g) * p, r_p = (e * c - g) * s;
    // It vanishes for eta = 1 at c = 0, and with it the numerators.
    float below = max(s * p, 1e-14);
    return 0.5 * (r_s * r_s + r_p * r_p) / (below * below);
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
