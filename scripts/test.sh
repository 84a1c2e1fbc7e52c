#!/usr/bin/env bash
# Everything that must hold before a commit: scripts, format, lints, docs, tests.
#
#   scripts/test.sh [arguments for cargo test]
#   scripts/test.sh optics -- --nocapture
#
# Without arguments two test files run at a time (MARMOR_TEST_JOBS says otherwise): each makes its pipelines on one core.
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

tests() { cargo test --release --workspace ${features:+"$features"} "$@" 2>&1; }

# later ARGUMENTS: those tests, and what they have said in one piece, once they are done.
later() {
    local status=0 log
    log=$(mktemp -p "$logs")
    # shellcheck disable=SC2086 # several words
    tests $1 >"$log" || status=$?
    flock "$logs" cat "$log"
    return "$status"
}

# every_test: for each run of cargo its arguments, those that take long first. A test file that is not named here comes after.
every_test() {
    local long=(mixture ledger view single bench flicker gpu_twins live) name
    {
        printf '%s\n' "${long[@]}"
        for name in tests/*.rs assets/sculptor/tests/*.rs; do basename "$name" .rs; done
    } | awk '!seen[$0]++ { print "--test " $0 }'
    echo '--lib --bins'
    echo '--doc'
}

# Last: what cargo says, then the sum over all test files.
say 'tests'
logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT
export -f tests later
export features logs
status=0
if [ $# = 0 ]; then
    every_test | xargs -P "${MARMOR_TEST_JOBS:-2}" -I{} bash -c 'later "$1"' later {} || status=1
else
    tests "$@" | tee "$logs/all" || status=$?
fi
cat "$logs"/* | awk '/^test result:/ { passed += $4; failed += $6 } END { printf "%d passed, %d failed\n", passed, failed }'
grep -h '^test .* FAILED$' "$logs"/* || true
exit "$status"
