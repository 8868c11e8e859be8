#!/bin/sh
# The main job on a sample capture, on a fresh Debian 12 machine too: installs packages, builds,
# renders photographs of a plastic ball, and makes a BRDF of them.
set -eu
cd "$(dirname "$0")/.."
sh .ci/build release goniocam
goniocam=build/release/goniocam
rm -rf out/plastic-ball out/plastic-ball-brdf
$goniocam render samples/plastic-ball.yaml -o out/plastic-ball
$goniocam reconstruct out/plastic-ball -o out/plastic-ball-brdf
