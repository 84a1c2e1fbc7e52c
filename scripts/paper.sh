#!/usr/bin/env bash
# The paper's table: frames a second of 1K, 5K and 20K triangles at 800x600, three quarters of it covered, by rings,
# samples and mixture. Writes docs/results/paper.md with what measured it, and its data beside it. About 3 minutes on
# 2 cores; times mean something on an idle machine only.
#
#   scripts/paper.sh [FRAMES]
set -euo pipefail
# shellcheck source=scripts/lib.sh
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$MARMOR_ROOT"

# shellcheck disable=SC2119 # the arguments are not for the set-up
marmor_setup
build_marmor
marmor=${CARGO_TARGET_DIR:-target}/release/marmor
mkdir -p out
"$marmor" bench --only paper/ --frames "${1:-24}" --json out/paper.json --csv docs/results/paper.csv -q
python3 scripts/paper.py out/paper.json >docs/results/paper.md
say 'wrote docs/results/paper.md'
