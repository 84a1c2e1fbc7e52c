#!/usr/bin/env bash
# Everything that must hold before a commit: scripts, format, lints, docs, tests.
#
#   scripts/test.sh [arguments for cargo test]
#   scripts/test.sh optics -- --nocapture
#
# A missing Vulkan device or validation layer is a failure here, not a skip.
# All steps use the release profile: another profile would build shaderc again.
set -euo pipefail
# shellcheck source=scripts/lib.sh
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$MARMOR_ROOT"

# step NAME COMMAND...: stops at the first failure; on CI, says how long it took.
step() {
    local name=$1 start=$SECONDS
    shift
    say "$name"
    "$@"
    [ "${CI:-}" != true ] || say "$name: $((SECONDS - start)) s"
}

check_scripts() {
    local script
    for script in scripts/*.sh .ci/run; do bash -n "$script"; done
    if have shellcheck; then
        shellcheck -x -S warning scripts/*.sh .ci/run
    else
        say 'shellcheck is not installed: syntax checked only'
    fi
}

step 'setup' marmor_setup --test
features=$MARMOR_CARGO_FEATURES
export MARMOR_REQUIRE_DEVICE=1 MARMOR_REQUIRE_VALIDATION=1

# Arguments before `--` also select what is compiled.
build=()
for argument in "$@"; do
    [ "$argument" != -- ] || break
    build+=("$argument")
done

step 'scripts' check_scripts
step 'format' cargo fmt --all --check
step 'clippy' watched cargo clippy --release --workspace --all-targets ${features:+"$features"} -- -D warnings
RUSTDOCFLAGS='-D warnings' step 'docs' watched cargo doc --release --workspace --no-deps ${features:+"$features"}
step 'build tests' watched cargo test --release --workspace ${features:+"$features"} --no-run ${build[@]+"${build[@]}"}

# Last: cargo's closing lines, then the sum over all test files.
say 'tests'
log=$(mktemp)
trap 'rm -f "$log"' EXIT
status=0
cargo test --release --workspace ${features:+"$features"} "$@" 2>&1 | tee "$log" || status=$?
awk '/^test result:/ { passed += $4; failed += $6 } END { printf "%d passed, %d failed\n", passed, failed }' "$log"
exit "$status"
