#!/usr/bin/env bash
# Makes this machine ready to build and run marmor; does nothing where it is.
#
#   scripts/setup.sh           what building and rendering need
#   scripts/setup.sh --test    and what the tests need
#   . scripts/setup.sh         the same, and sets CARGO_TARGET_DIR and
#                              MARMOR_CARGO_FEATURES in this shell (bash)
#
# Debian and Ubuntu: installs what is missing. Elsewhere: names it.
# Exit code 2: something is missing that could not be installed.

# shellcheck source=scripts/lib.sh
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
marmor_setup "$@"
