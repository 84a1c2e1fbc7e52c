#!/usr/bin/env bash
# Figure 1: the statue without (left half) and with subsurface scattering, single and multiple.
# Sets the machine up, builds, renders out/figure1.png and says what a frame of either method costs. Then the betta swims
# while the camera goes once around it: out/turntable.gif, and its 48 frames in out/turntable/.
#
#   scripts/demo.sh [arguments for `marmor render`]
set -euo pipefail
# shellcheck source=scripts/lib.sh
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$MARMOR_ROOT"

picture=out/figure1.png
stats=out/figure1.json

# shellcheck disable=SC2119 # the arguments are not for the set-up
marmor_setup
build_marmor

mkdir -p out
marmor() {
    cargo run --release --quiet ${MARMOR_CARGO_FEATURES:+"$MARMOR_CARGO_FEATURES"} -- render \
        --size 800x600 --light=-140,35 --exposure 2.5 --background '#15171c' "$@"
}
say "rendering $picture: 800x600, 192 frames averaged, about half a minute on 2 cores"
status=0
marmor -o "$picture" --split brdf --multiple mixture --volumes 4 --single 8 --frames-averaged 192 \
    --stats "$stats" "$@" || status=$?
if [ "$status" -eq 3 ]; then
    complain 'no usable Vulkan device. On Debian and Ubuntu, mesa-vulkan-drivers renders on the CPU;'
    complain 'what is there and what it lacks: cargo run --release -- devices'
fi
[ "$status" -eq 0 ] || exit "$status"

# Each half's method on the whole picture, so that their frame times can be compared.
say 'timing: both methods, 24 frames each'
marmor -q -o out/left.png --multiple brdf --frames-averaged 24 --stats out/left.json
marmor -q -o out/right.png --multiple mixture --volumes 4 --single 8 --frames-averaged 24 --stats out/right.json

# The one place that knows the keys of --stats.
python3 - "$stats" out/left.json out/right.json <<'PYTHON'
import json
import sys


def load(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def frame_time(stats):
    passes = ", ".join(f"{p['pass']} {p['milliseconds']:.1f}" for p in stats["times"]["passes"] if p["pass"] != "readback")
    return f"{stats['times']['wall']:.1f} ms a frame ({passes})"


def fetches(stats):
    terms = ", ".join(
        f"{term['per_pixel']} {term['what']}"
        for p in stats["fetches"]["passes"]
        for term in p["terms"]
        if term["term"] not in ("input", "texel", "buffer")
    )
    return f"{stats['fetches']['per_pixel']} ({terms})"


figure, left, right = map(load, sys.argv[1:])
lines = [
    ("device", figure["device"]["name"]),
    ("opaque, left", frame_time(left)),
    ("translucent, right", frame_time(right)),
    ("fetches per pixel", fetches(right)),
]
for name, value in lines:
    print(f"{name + ':':<19} {value}")
PYTHON
printf '%-19s %s\n' 'picture:' "$MARMOR_ROOT/$picture"

# A frame depends on its number alone, so those that are there from an earlier run need not be drawn again; but who
# runs a demo has changed something.
animate() {
    cargo run --release --quiet ${MARMOR_CARGO_FEATURES:+"$MARMOR_CARGO_FEATURES"} -- animate assets/scenes/betta.toml \
        --turntable --light-turns 0 --fps 20 --size 320x240 --frames-averaged 4 "$@"
}
say 'animating: 48 frames, 320x240, about a quarter of a minute on 2 cores'
animate -o out/turntable/%02d.png
animate -q -o out/turntable.gif
printf '%-19s %s\n' 'turntable:' "$MARMOR_ROOT/out/turntable.gif"
printf '%-19s %s\n' 'its frames:' "$MARMOR_ROOT/out/turntable/00.png to 47.png"
