#!/usr/bin/env bash
# Checks that take too long for every commit, on 2 cores: in about 3 minutes `samples` against `exact` at 200x150 with
# a 512^2 light map, in one frame and in the mean of 64; in about 10 the fetch ledger of every plan, pixel by pixel; in about
# 10 the flicker of every method over a loop, and the memory over 10 000 frames in which everything moves.
# Prints a table and exits 1 where a bound does not hold.
#
#   scripts/soak.sh
set -euo pipefail
# shellcheck source=scripts/lib.sh
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$MARMOR_ROOT"

# shellcheck disable=SC2119 # the arguments are not for the set-up
marmor_setup
build_marmor
marmor=${CARGO_TARGET_DIR:-target}/release/marmor
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

failed=0
# check MATERIAL FRAMES BOUND: rr of `samples` with FRAMES frames averaged.
check() {
    local rr verdict=ok
    "$marmor" render -q -o "$folder/samples.exr" "${common[@]}" --material "$1" \
        --multiple samples --samples 30 --frames-averaged "$2" --jitter samples
    "$marmor" compare "$folder/exact.exr" "$folder/samples.exr" --json --max-rr "$3" \
        >"$folder/result.json" 2>/dev/null || { verdict=FAILED; failed=1; }
    rr=$(python3 -c 'import json, sys; print("%.4f" % json.load(open(sys.argv[1]))["rr"])' "$folder/result.json")
    printf '| %-8s | %2s | %s | %s | %s |\n' "$1" "$2" "$rr" "$3" "$verdict"
}

common=(--specular off --single off --size 200x150)
printf '| material | frames | rr | at most | |\n|---|---|---|---|---|\n'
while read -r material bound; do
    "$marmor" render -q -o "$folder/exact.exr" "${common[@]}" --material "$material" --multiple exact
    check "$material" 1 "$bound"
    check "$material" 64 0.02
done <<'BOUNDS'
marble 0.10
skin1 0.13
ketchup 0.15
BOUNDS
# Every plan of the ledger, counted pixel by pixel.
say "the ledger, all plans"
MARMOR_LEDGER_ALL=1 MARMOR_REQUIRE_DEVICE=1 MARMOR_REQUIRE_VALIDATION=1 \
    cargo test --release --workspace ${MARMOR_CARGO_FEATURES:+"$MARMOR_CARGO_FEATURES"} --test ledger || failed=1
# Everything moves.
say "flicker, a whole loop"
MARMOR_FLICKER_ALL=1 MARMOR_REQUIRE_DEVICE=1 MARMOR_REQUIRE_VALIDATION=1 \
    cargo test --release --workspace ${MARMOR_CARGO_FEATURES:+"$MARMOR_CARGO_FEATURES"} --test flicker -- --nocapture || failed=1
say "memory, 10 000 frames"
MARMOR_SOAK_FRAMES=10000 MARMOR_REQUIRE_DEVICE=1 MARMOR_REQUIRE_VALIDATION=1 \
    cargo test --release --workspace ${MARMOR_CARGO_FEATURES:+"$MARMOR_CARGO_FEATURES"} --test animation memory -- --nocapture || failed=1
exit "$failed"
