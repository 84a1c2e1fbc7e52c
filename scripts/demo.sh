#!/usr/bin/env bash
# Figure 1: the statue without (left half) and with subsurface scattering.
# Sets the machine up, builds, renders out/figure1.png and says what it cost.
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
watched cargo build --release ${MARMOR_CARGO_FEATURES:+"$MARMOR_CARGO_FEATURES"}

mkdir -p out
say "rendering $picture: 800x600, 192 frames averaged, about half a minute on 2 cores"
status=0
cargo run --release --quiet ${MARMOR_CARGO_FEATURES:+"$MARMOR_CARGO_FEATURES"} -- \
    render -o "$picture" --size 800x600 --split brdf --multiple samples --samples 30 \
    --frames-averaged 192 \
    --light=-140,35 --exposure 2.5 --background '#15171c' --stats "$stats" "$@" || status=$?
if [ "$status" -eq 3 ]; then
    complain 'no usable Vulkan device. On Debian and Ubuntu, mesa-vulkan-drivers renders on the CPU;'
    complain 'what is there and what it lacks: cargo run --release -- devices'
fi
[ "$status" -eq 0 ] || exit "$status"

# The one place that knows the keys of --stats.
python3 - "$stats" <<'PYTHON'
import json
import sys


def summary(stats):
    yield "device", stats["device"]["name"]
    passes = ", ".join(f"{p['pass']} {p['milliseconds']:.1f}" for p in stats["times"]["passes"])
    yield "frame time", f"{stats['times']['wall']:.1f} ms ({passes})"
    terms = ", ".join(
        f"{term['per_pixel']} {term['what']}"
        for p in stats["fetches"]["passes"]
        for term in p["terms"]
        if term["term"] != "input"
    )
    yield "fetches per pixel", f"{stats['fetches']['per_pixel']} ({terms})"


with open(sys.argv[1], encoding="utf-8") as file:
    for name, value in summary(json.load(file)):
        print(f"{name + ':':<19} {value}")
PYTHON
printf '%-19s %s\n' 'picture:' "$MARMOR_ROOT/$picture"
