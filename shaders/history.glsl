// What a frame drawn once takes over from those before it, for live display. CPU twin: `joined` of cpu/resolve.rs.
#ifdef LIVE

// Where the surface of each pixel was in the frame before, minus where it is, pixels; 0 where there is none.
layout(binding = 3) uniform sampler2D motion;
layout(binding = 4) uniform sampler2D view_depth;

// How much of the picture is the new frame, where nothing moves? Less leaves less noise, more forgets light and shadow
// that have moved sooner: of a tenth, a half is new after seven frames.
const float SHARE = 0.1;
// How much where it moves by so many pixels a frame? History is then taken from between pixels, and each time blurred:
// older than a few frames it costs more detail than it saves noise (docs/methods/history.md).
const float SHARE_MOVING = 0.3;
const float MOVING = 0.5;
// How much where history shows something else? A half still averages the edges of what has come into sight.
const float SHARE_NEW = 0.5;
// How many deviations of the new neighbourhood may history lie from its mean? With less, noise comes back; with more,
// ghosts.
const float REACH = 1.0;
// How far beyond does history show something else, in deviations? Noise alone seldom goes so far.
const float ELSEWHERE = 2.0;

// Luminance, two differences of colour, and coverage: noise and shading lie along the first.
vec4 to_luma(vec4 c) {
    return vec4(0.25 * c.r + 0.5 * c.g + 0.25 * c.b, 0.5 * (c.r - c.b), 0.5 * c.g - 0.25 * (c.r + c.b), c.a);
}

vec4 from_luma(vec4 c) {
    return vec4(c.x + c.y - c.z, c.x + c.z, c.x - c.y - c.z, c.a);
}

// Catmull and Rom's cubic at texel coordinates `st`, by five bilinear taps: the corners, which weigh least, are left
// out. Beyond the picture it goes on as at its edge.
vec4 history_at(vec2 st, vec2 size) {
    vec2 texel = 1.0 / size;
    vec2 middle = floor(st - 0.5) + 0.5;
    vec2 f = st - middle;
    vec2 before = f * (-0.5 + f * (1.0 - 0.5 * f));
    vec2 after = f * f * (0.5 * f - 0.5);
    vec2 right = f * (0.5 + f * (2.0 - 1.5 * f));
    vec2 inner = 1.0 - before - after;
    vec2 at = middle + right / inner;
    vec4 sum = inner.x * inner.y * FETCH_LINEAR(mean, at, texel);
    vec2 first = max(middle - 1.0, 0.5), last = min(middle + 2.0, size - 0.5);
    sum += before.x * inner.y * FETCH_LINEAR(mean, vec2(first.x, at.y), texel);
    sum += after.x * inner.y * FETCH_LINEAR(mean, vec2(last.x, at.y), texel);
    sum += inner.x * before.y * FETCH_LINEAR(mean, vec2(at.x, first.y), texel);
    sum += inner.x * after.y * FETCH_LINEAR(mean, vec2(at.x, last.y), texel);
    return sum / (inner.x * inner.y + (before.x + after.x) * inner.y + inner.x * (before.y + after.y));
}

// The new frame's `value` at pixel coordinates `pixel`, joined with history.
vec4 joined(vec2 pixel, ivec2 size, vec4 value) {
    // Nothing before: what it would read is undefined.
    if (frame.sequence.z >= 1.0) return value;

    // Mean and deviation of 3x3 pixels, as differences from the middle one, which keeps float32 sharp.
    const vec2 AROUND[8] = vec2[](vec2(-1.0, -1.0), vec2(0.0, -1.0), vec2(1.0, -1.0), vec2(-1.0, 0.0),
                                  vec2(1.0, 0.0), vec2(-1.0, 1.0), vec2(0.0, 1.0), vec2(1.0, 1.0));
    vec2 last = vec2(size) - 0.5;
    vec4 own = to_luma(value);
    vec4 sum = vec4(0.0), squares = vec4(0.0);
    for (int i = 0; i < 8; ++i) {
        vec2 near = clamp(pixel + AROUND[i], vec2(0.5), last);
        vec4 off = to_luma(FETCH_NEAREST(radiance, near, size)) - own;
        sum += off;
        squares += off * off;
    }
    vec4 off = sum / 9.0;
    vec4 deviation = sqrt(max(squares / 9.0 - off * off, vec4(0.0)));

    // Beside a silhouette the edge moves with what is in front. Elsewhere a pixel's own motion is the better one.
    vec2 front = pixel;
    float nearest = FETCH_NEAREST(view_depth, pixel, size).x;
    if (nearest >= 1.0) {
        for (int i = 0; i < 8; ++i) {
            vec2 near = clamp(pixel + AROUND[i], vec2(0.5), last);
            float depth = FETCH_NEAREST(view_depth, near, size).x;
            if (depth < nearest) {
                nearest = depth;
                front = near;
            }
        }
    }
    vec2 moved = FETCH_NEAREST(motion, front, size).xy;
    vec2 place = pixel + moved;
    // Written so that NaN is outside, too.
    bool inside = all(greaterThanEqual(place, vec2(0.0))) && all(lessThanEqual(place, vec2(size)));
    if (!inside) return value;
    vec4 old = to_luma(history_at(clamp(place, vec2(0.5), last), vec2(size)));
    // Lest one bad number stay for ever.
    if (any(isnan(old)) || any(isinf(old))) return value;

    // What the pixel itself shows is never out of reach: beside a silhouette history must be free to fall to nothing.
    vec4 reach = REACH * deviation;
    vec4 kept = clamp(old, own + min(off - reach, 0.0), own + max(off + reach, 0.0));
    // Where coverage or luminance lies far beyond, history is of another surface.
    vec4 beyond = abs(old - kept) / max(deviation, vec4(1e-3 * own.x + 1e-6));
    float elsewhere = clamp(max(beyond.x, beyond.w) / ELSEWHERE, 0.0, 1.0);
    float share = mix(SHARE, SHARE_MOVING, clamp(length(moved) / MOVING, 0.0, 1.0));
    share = max(frame.sequence.z, mix(share, SHARE_NEW, elsewhere));
    // A value far beyond white counts for less, lest one bright sample flicker for ten frames.
    float fresh = share / (1.0 + max(frame.z_v.w * own.x - 1.0, 0.0));
    float stale = (1.0 - share) / (1.0 + max(frame.z_v.w * kept.x - 1.0, 0.0));
    return max(from_luma(mix(kept, own, fresh / (fresh + stale))), vec4(0.0));
}
#endif
