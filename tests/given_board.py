#!/usr/bin/python3
"""Somebody else's calibration over a lit board: capture.yaml says where the board is, the photographs how bright.

    tests/given_board.py GONIOCAM PROJECT

The calibration is written here, from the scene's own numbers. Limits are those of the row "lit board" in
round_trip_matrix.py; with the board's light left in, 5 % of the bins are wrong by more than 30 %.
"""
import json
import os
import subprocess
import sys
import tempfile

import numpy as np
import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import given
import limits
import truth as T
from limits import check


def main():
    goniocam, project = sys.argv[1:3]
    with open(os.path.join(project, "samples/tiny.yaml")) as f:
        scene = yaml.safe_load(f)
    for name, bounces in ("lit", 1), ("unlit", 0):
        with tempfile.TemporaryDirectory() as folder:
            at = lambda file: os.path.join(folder, file)
            run = lambda *a: subprocess.check_call([goniocam, *a, "--quiet"], stdout=subprocess.DEVNULL)
            with open(at("scene.yaml"), "w") as f:
                yaml.safe_dump(dict(scene, bounces=bounces), f)
            run("render", at("scene.yaml"), "-o", at("capture"))
            truth = T.Truth(at("capture/truth.json"))
            with open(at("calibration.yaml"), "w") as f:
                yaml.safe_dump(given.calibration(truth.t), f)
            run("reconstruct", at("capture"), "-o", at("out"), "--calibration", at("calibration.yaml"))
            error, z = truth.bins(at("out"))
            with open(at("out/run.json")) as f:
                strength = json.load(f)["interreflection"]["strength"]
            print(name)
            check("  bins, median %", 100 * np.median(np.abs(error)), 0, 0.8)
            check("  bins, 95 %", 100 * np.quantile(np.abs(error), 0.95), 0, 3)
            check("  share of bins beyond 2 sigma", (np.abs(z) > 2).mean(), 0, 0.07)
            check("  error of the light's strength", abs(strength - bounces), 0, 0.05)
    sys.exit(1 if limits.failed else 0)


if __name__ == "__main__":
    main()
