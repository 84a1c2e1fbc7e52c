#version 460
// The deform pass: a vertex at rest, morphed, skinned and bent. CPU twin: cpu/deform.rs.
//
// Morph targets are added, joints blended as matrices (glTF 2.0, "Skins"), and deformers applied in turn. Normals follow
// by the cofactors of each Jacobian, which keep them perpendicular under scaling and shear.

layout(local_size_x = 64) in;

// Joints that a vertex follows: 0 (the first alone), 4 or 8.
layout(constant_id = 0) const uint INFLUENCES = 0;
// Whether anything morphs.
layout(constant_id = 1) const bool MORPHS = false;

const float TAU = 6.28318530717959;

// Kinds of a deformer: Kind of scene/deformer.rs.
const uint TWIST = 0;
const uint BEND = 1;
const uint BREATHE = 2;
const uint WAVE = 3;

struct Bend {
    vec4 base;     // a point on the axis, level with the base, mm; w: the kind
    vec4 axis;     // unit vector; w: 1 / distance from base to tip, of a wave 1 / wavelength, mm^-1
    vec4 towards;  // unit vector across it; w: radians from base to tip, a fraction, or mm
    vec4 phase;    // x: of a wave at the base, radians
};

// Mirrored by frame/deform.rs.
layout(binding = 0, std140) uniform Pose {
    uvec4 counts;  // the shape's first vertex at rest, how many it has, how many deformers
    Bend bends[4];
} pose;
// Of each joint three rows of a matrix: from the file's unit, relative to the rest's middle, to mm, relative to the scene's.
layout(binding = 1, std430) readonly buffer Palette { vec4 palette[]; };
layout(binding = 2, std430) readonly buffer MorphWeights { float morph_weights[]; };
// Of each vertex its position and normal, three floats each.
layout(binding = 3, std430) readonly buffer Rest { float rest[]; };
// Of each vertex INFLUENCES joints, two a word, and as many weights.
layout(binding = 4, std430) readonly buffer Influences { uint influences[]; };
// Of each vertex its first morph, the first of their weights, and how many.
layout(binding = 5, std430) readonly buffer VertexMorphs { uint vertex_morphs[]; };
// Of each morph what it adds to position and normal.
layout(binding = 6, std430) readonly buffer Morphs { float morphs[]; };
layout(binding = 7, std430) writeonly buffer Vertices { float vertices[]; };

// What takes normals where `m` takes points, but for their length.
mat3 cofactors(mat3 m) {
    return mat3(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1]));
}

// sin(x) / x and (1 - cos(x)) / x, which near 0 are their series.
vec2 arc(float x) {
    return abs(x) < 1e-2 ? vec2(1.0 - x * x / 6.0, 0.5 * x - x * x * x / 24.0) : vec2(sin(x), 1.0 - cos(x)) / x;
}

// Bend::apply of scene/deformer.rs: moves `p`, and turns `n` with the cofactors of the Jacobian.
void bend(Bend b, inout vec3 p, inout vec3 n) {
    vec3 a = b.axis.xyz;
    float k = b.axis.w;
    vec3 q = p - b.base.xyz;
    float h = dot(q, a);
    vec3 across = q - a * h;
    float amount = b.towards.w;
    mat3 jacobian = mat3(1.0);
    uint kind = uint(b.base.w);
    if (kind == TWIST) {
        float angle = amount * k * h;
        float s = sin(angle), c = cos(angle);
        // Rodrigues, of what lies across the axis.
        vec3 turned = across * c + cross(a, across) * s;
        mat3 skew = mat3(0.0, a.z, -a.y, -a.z, 0.0, a.x, a.y, -a.x, 0.0);
        mat3 along = outerProduct(a, a);
        jacobian = c * (mat3(1.0) - along) + s * skew + along + outerProduct(cross(a, turned) * (amount * k), a);
        p = b.base.xyz + a * h + turned;
    } else if (kind == BEND) {
        vec3 t = b.towards.xyz;
        float curvature = amount * k;
        float x = dot(q, t);
        float angle = curvature * h;
        vec2 point = h * arc(angle);
        float s = sin(angle), c = cos(angle);
        vec3 third = cross(a, t);
        vec3 rest_of = q - a * h - t * x;
        p = b.base.xyz + rest_of + a * (point.x - x * s) + t * (point.y + x * c);
        jacobian = outerProduct((a * c + t * s) * (1.0 - curvature * x), a) + outerProduct(t * c - a * s, t)
                 + outerProduct(third, third);
    } else if (kind == BREATHE) {
        float u = clamp(h * k, 0.0, 1.0) * 0.5 * TAU;
        float s = sin(u), c = cos(u);
        float wide = 1.0 + amount * s * s;
        float slope = amount * s * c * TAU * k;
        jacobian = mat3(wide) + outerProduct(a * (1.0 - wide) + across * slope, a);
        p = b.base.xyz + a * h + across * wide;
    } else {
        float at = TAU * k * h + b.phase.x;
        jacobian += outerProduct(b.towards.xyz * (amount * TAU * k * cos(at)), a);
        p += b.towards.xyz * (amount * sin(at));
    }
    n = cofactors(jacobian) * n;
}

void main() {
    uint vertex = gl_GlobalInvocationID.x;
    if (vertex >= pose.counts.y) {
        return;
    }
    uint at = 6 * (pose.counts.x + vertex);
    vec3 p = vec3(rest[at], rest[at + 1], rest[at + 2]);
    vec3 n = vec3(rest[at + 3], rest[at + 4], rest[at + 5]);

    if (MORPHS) {
        uint first = vertex_morphs[3 * vertex];
        uint weight = vertex_morphs[3 * vertex + 1];
        uint count = vertex_morphs[3 * vertex + 2];
        for (uint i = 0; i < count; ++i) {
            float w = morph_weights[weight + i];
            uint m = 6 * (first + i);
            p += w * vec3(morphs[m], morphs[m + 1], morphs[m + 2]);
            n += w * vec3(morphs[m + 3], morphs[m + 4], morphs[m + 5]);
        }
    }

    vec4 rows[3] = vec4[3](palette[0], palette[1], palette[2]);
    if (INFLUENCES > 0) {
        rows = vec4[3](vec4(0.0), vec4(0.0), vec4(0.0));
        uint own = vertex * (INFLUENCES / 2 + INFLUENCES);
        for (uint i = 0; i < INFLUENCES; ++i) {
            uint joint = 3 * ((influences[own + i / 2] >> (16 * (i & 1u))) & 0xffffu);
            float w = uintBitsToFloat(influences[own + INFLUENCES / 2 + i]);
            rows[0] += w * palette[joint];
            rows[1] += w * palette[joint + 1];
            rows[2] += w * palette[joint + 2];
        }
    }
    p = vec3(dot(rows[0], vec4(p, 1.0)), dot(rows[1], vec4(p, 1.0)), dot(rows[2], vec4(p, 1.0)));
    n = cofactors(transpose(mat3(rows[0].xyz, rows[1].xyz, rows[2].xyz))) * n;

    for (uint i = 0; i < pose.counts.z; ++i) {
        bend(pose.bends[i], p, n);
    }

    float squared = dot(n, n);
    n = squared > 0.0 ? n * inversesqrt(squared) : vec3(0.0, 1.0, 0.0);
    uint to = 6 * vertex;
    vertices[to] = p.x;
    vertices[to + 1] = p.y;
    vertices[to + 2] = p.z;
    vertices[to + 3] = n.x;
    vertices[to + 4] = n.y;
    vertices[to + 5] = n.z;
}
