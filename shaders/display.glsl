// What a window stores: light, where its format encodes, else bytes of sRGB.

// Whether the window's format encodes sRGB as it stores.
layout(constant_id = 0) const bool ENCODES = true;

// The transfer function of sRGB (IEC 61966-2-1).
vec3 encode_srgb(vec3 x) {
    return mix(12.92 * x, 1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, greaterThan(x, vec3(0.0031308)));
}

// And its inverse.
vec3 decode_srgb(vec3 x) {
    return mix(x / 12.92, pow((x + 0.055) / 1.055, vec3(2.4)), greaterThan(x, vec3(0.04045)));
}

// Linear colour as the window wants it written.
vec3 stored(vec3 color) {
    return ENCODES ? color : encode_srgb(color);
}
