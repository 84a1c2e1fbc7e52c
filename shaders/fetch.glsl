// The only place that touches a texture. Every read of every pass goes through one
// of these macros, so that fetches can be counted, statically and at run time.

// The counting build: GLSL's own reads, whoever calls them, count themselves by the term they serve, and main stores
// the counts before it ends. Otherwise it computes what the plain build computes.
#define TERM_SINGLE 0
#define TERM_MULTIPLE 1
#define TERM_OTHER 2
#define TERM_INPUT 3
#ifdef COUNTING
layout(binding = 15, std430) buffer Counts {
    uvec4 counts_size; // x: columns of the picture
    uvec4 counts[];    // of each pixel; of passes that make several texels at once, one entry
};
// One store a pixel, in place of what the previous frame stored there; with `more`, added to what an earlier dispatch
// of this frame did.
#define STORE_COUNTS(pixel, more)                                \
    uint counts_at = uint((pixel).y) * counts_size.x + uint((pixel).x); \
    if (more) counted += counts[counts_at];                      \
    counts[counts_at] = counted
// The most that any invocation has read.
#define STORE_MOST_COUNTS() for (int term = 0; term < 4; ++term) atomicMax(counts[0][term], counted[term])
uvec4 counted = uvec4(0);
uint counted_term = TERM_OTHER;
uint count_read(uint term) { return counted[term] += 1u; }
#define COUNT_AS(term) counted_term = term
#define COUNTED(read) (count_read(counted_term), read)
#define texture(a, b) COUNTED(texture(a, b))
#define textureLod(a, b, c) COUNTED(textureLod(a, b, c))
#define texelFetch(a, b, c) COUNTED(texelFetch(a, b, c))
#define textureGather(a, b, c) COUNTED(textureGather(a, b, c))
#define imageLoad(a, b) COUNTED(imageLoad(a, b))
#define subpassLoad(a) (count_read(TERM_INPUT), subpassLoad(a))
#else
#define COUNT_AS(term)
#define STORE_COUNTS(pixel, more)
#define STORE_MOST_COUNTS()
#endif

// One texel, by integer coordinates. Out-of-range coordinates are the caller's bug.
#define FETCH_TEXEL(tex, ij) texelFetch(tex, ij, 0)

// The nearest texel, or the border, at texel coordinates `st` of a texture of `size` texels.
#define FETCH_NEAREST(tex, st, size) textureLod(tex, (st) / vec2(size), 0.0)

// Bilinear tap at texel coordinates `st` of MIP level `level`, whose texels are `texel` = 1 / size
// of the texture: texel (i, j) has its centre at (i + 1/2, j + 1/2). NO_LINEAR is for devices that
// cannot filter the texture's format, and has a sampler of the nearest texel.
#ifdef NO_LINEAR
vec4 fetch_linear(sampler2D tex, vec2 st, vec2 texel, float level) {
    vec2 f = fract(st - 0.5);
    vec2 corner = st - f;
    vec4 low = mix(textureLod(tex, corner * texel, level),
                   textureLod(tex, (corner + vec2(1.0, 0.0)) * texel, level), f.x);
    vec4 high = mix(textureLod(tex, (corner + vec2(0.0, 1.0)) * texel, level),
                    textureLod(tex, (corner + vec2(1.0, 1.0)) * texel, level), f.x);
    return mix(low, high, f.y);
}
#define FETCH_LINEAR_LEVEL(tex, st, texel, level) fetch_linear(tex, st, texel, level)
#else
#define FETCH_LINEAR_LEVEL(tex, st, texel, level) textureLod(tex, (st) * (texel), level)
#endif
#define FETCH_LINEAR(tex, st, texel) FETCH_LINEAR_LEVEL(tex, st, texel, 0.0)

// What the sampler, of the nearest texel or bilinear, gives at texel coordinates `st`.
#define FETCH_FILTERED(tex, st, texel) textureLod(tex, (st) * (texel), 0.0)

// Trilinear tap at `at` of a volume, whose cells are `cell` = 1 / size of it: cell (i, j, k) has its centre at
// (i + 1/2, j + 1/2, k + 1/2).
#ifdef NO_LINEAR
float fetch_slice(sampler3D tex, vec3 corner, vec2 f, vec3 cell) {
    float low = mix(textureLod(tex, corner * cell, 0.0).x,
                    textureLod(tex, (corner + vec3(1.0, 0.0, 0.0)) * cell, 0.0).x, f.x);
    float high = mix(textureLod(tex, (corner + vec3(0.0, 1.0, 0.0)) * cell, 0.0).x,
                     textureLod(tex, (corner + vec3(1.0, 1.0, 0.0)) * cell, 0.0).x, f.x);
    return mix(low, high, f.y);
}
float fetch_volume(sampler3D tex, vec3 at, vec3 cell) {
    vec3 f = fract(at - 0.5);
    vec3 corner = at - f;
    return mix(fetch_slice(tex, corner, f.xy, cell),
               fetch_slice(tex, corner + vec3(0.0, 0.0, 1.0), f.xy, cell), f.z);
}
#define FETCH_VOLUME(tex, at, cell) fetch_volume(tex, at, cell)
#else
#define FETCH_VOLUME(tex, at, cell) textureLod(tex, (at) * (cell), 0.0).x
#endif

// For each of the 2x2 texels around `st`, whether it is at least as deep as `reference`: x and y
// in the higher row, w and z in the lower, from left to right.
#define FETCH_GATHER_COMPARE(tex, st, size, reference) \
    textureGather(tex, (st) / float(size), reference)

// One texel of a storage image.
#define FETCH_IMAGE(img, ij) imageLoad(img, ij)

// The pixel's own value of an input attachment; on its own line of the ledger.
#define READ_INPUT(attachment) subpassLoad(attachment)
