#!/bin/sh
# All tests, on a fresh Debian 12 machine too: installs packages, builds, runs all tests in release
# and most of them again under sanitizers, fuzzes every reader for a moment, and checks that each
# face compiles alone and that the layout is clang-format's.
set -eu
cd "$(dirname "$0")/.."
sh .ci/build release
sh .ci/build sanitize
sh .ci/build fuzz
cmake --build --preset release --target all_verify_interface_header_sets >&2
find capture calib reconstruct samples tests goniocam.c -name '*.[ch]' -o -name '*.cc' \
    | xargs clang-format --dry-run --Werror
ctest --preset fuzz -j "$(nproc)"
ctest --preset sanitize -LE slow -j "$(nproc)"
ctest --preset release -j "$(nproc)"
