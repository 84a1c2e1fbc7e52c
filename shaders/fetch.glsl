// The only place that touches a texture. Every read of every pass goes through one
// of these macros, so that fetches can be counted, statically and at run time.

// One texel, by integer coordinates. Out-of-range coordinates are the caller's bug.
#define FETCH_TEXEL(tex, ij) texelFetch(tex, ij, 0)

// The nearest texel, or the border, at texel coordinates `st` of a map of `size` texels a side.
#define FETCH_NEAREST(tex, st, size) textureLod(tex, (st) / float(size), 0.0)

// For each of the 2x2 texels around `st`, whether it is at least as deep as `reference`: x and y
// in the higher row, w and z in the lower, from left to right.
#define FETCH_GATHER_COMPARE(tex, st, size, reference) \
    textureGather(tex, (st) / float(size), reference)

// One texel of a storage image.
#define FETCH_IMAGE(img, ij) imageLoad(img, ij)

// The pixel's own value of an input attachment; on its own line of the ledger.
#define READ_INPUT(attachment) subpassLoad(attachment)
