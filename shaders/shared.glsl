// What every pass shares: the frame's uniforms and the geometry of its maps.
// Lengths are in mm, coefficients in mm^-1. Positions are relative to the scene's
// centre, which keeps float32 sharp however far from the origin a mesh lies.

const float PI = 3.14159265358979;

// Mirrored field by field by frame/uniforms.rs; tests/uniforms.rs holds the two together.
layout(set = 0, binding = 0, std140) uniform Frame {
    mat4 view_proj;      // scene to clip space of the camera
    mat4 light_proj;     // scene to clip space of the light
    vec4 eye;            // camera position; w: near * far
    vec4 ray_0;          // ray(x, y) = ray_0 + x ray_x + y ray_y; w: far
    vec4 ray_x;          // w: far - near
    vec4 ray_y;
    vec4 light_u;        // unit axis of the map's columns; w: minus the map's corner
    vec4 light_v;        // unit axis of the map's rows; w: minus the map's corner
    vec4 light_z;        // unit axis away from the light; w: minus the middle depth
    vec4 light_scale;    // texel, 1 / texel, half depth range, 1 / half depth range
    vec4 map;            // side of the map in texels, 1 / columns and 1 / rows of its image; w: Taps::kept of scene/plan.rs
    vec4 irradiance;     // E0 per channel; w: area of a light texel, mm^2
    vec4 sigma_tr;       // effective transport coefficient per channel; w: eta
    vec4 z_r;            // depth of the real source per channel; w: GGX alpha
    vec4 z_v;            // height of the virtual source per channel; w: exposure
    vec4 alpha_prime;    // reduced albedo per channel
    vec4 r_tot;          // total diffuse reflectance per channel
    vec4 sequence;       // offsets of radius and angle of this frame's samples; z: 1 / (frames so far + 1)
    vec4 background;     // linear rgb; w: 1 where it is put behind the picture
    vec4 sigma_s;        // scattering coefficient, not reduced, per channel
    vec4 sigma_t;        // extinction sigma_s + sigma_a per channel; w: mean cosine g
    vec4 path;           // what the weight tells of the refracted path: PathFit of optics/single.rs
    vec4 march;          // first step, deepest sample, mm; Ft at normal incidence; variance of an edge's depths
    vec4 level_weights[9];  // of each level of the mixture: W per channel; w: s^2, s over the half depth range
    vec4 level_places[9];   // 2^-level, and the level's corner in the atlas, texels; w: s
    vec4 volume_scale;      // 1 / columns, 1 / rows, 1 / slices of the volumes' image; w: half depth range in texels
    vec4 volume_places[9];  // of each level with a volume: its cell at the map's corner, in the middle of the depths; w: cells a texel
    vec4 rings[14];         // of each ring: E0 times its light's area times R_d at its radius; w: 1 / side of its level
} frame;

// Depth of the clip range that the caster's depth range fills, so that its ends are never clipped.
const float LIGHT_DEPTH_MARGIN = 1.001;

// Scene to light space: mm from the map's outer corner, and normalised depth.
vec3 to_light_space(vec3 p) {
    return vec3(dot(frame.light_u.xyz, p) + frame.light_u.w,
                dot(frame.light_v.xyz, p) + frame.light_v.w,
                (dot(frame.light_z.xyz, p) + frame.light_z.w) * frame.light_scale.w);
}

// Normalised light-space depth in [-1, 1] to the depth buffer of the light pass.
float to_light_depth(float z_n) {
    return 0.5 + 0.5 * z_n / LIGHT_DEPTH_MARGIN;
}

// Camera depth-buffer value to distance along the optical axis.
float axial(float depth) {
    return frame.eye.w / (frame.ray_0.w - depth * frame.ray_x.w);
}

// The ray through pixel coordinates `xy`, whose component along the optical axis is 1.
vec3 view_ray(vec2 xy) {
    return frame.ray_0.xyz + xy.x * frame.ray_x.xyz + xy.y * frame.ray_y.xyz;
}

// The position seen at pixel coordinates `xy`.
vec3 position(vec2 xy, float depth) {
    return frame.eye.xyz + view_ray(xy) * axial(depth);
}

// Unit vector to the octahedron folded onto [-1, 1]^2 (Cigolle et al. 2014), and back.
vec2 encode_normal(vec3 n) {
    n.xy /= abs(n.x) + abs(n.y) + abs(n.z);
    vec2 folded = (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    return n.z >= 0.0 ? n.xy : folded;
}

vec3 decode_normal(vec2 e) {
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    float fold = max(-n.z, 0.0);
    n.xy -= vec2(n.x >= 0.0 ? fold : -fold, n.y >= 0.0 ? fold : -fold);
    return normalize(n);
}
