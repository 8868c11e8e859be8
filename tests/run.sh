#!/bin/sh
# All tests, on a fresh Debian 12 machine too: installs packages, builds both presets, runs both,
# checks that each face compiles alone and that the layout is clang-format's.
set -eu
cd "$(dirname "$0")/.."
sh .ci/build release
sh .ci/build sanitize
cmake --build --preset release --target all_verify_interface_header_sets >&2
git ls-files '*.c' '*.h' '*.cc' 2>/dev/null | xargs -r clang-format --dry-run --Werror
ctest --preset sanitize -LE slow
ctest --preset release
