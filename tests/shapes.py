#!/usr/bin/python3
"""Other samples and sensors, given the calibration: a cylinder; a ball in raw files of a mosaic sensor.

    tests/shapes.py GONIOCAM PROJECT

Variations of samples/tiny.yaml, rendered and reconstructed.
"""
import os
import subprocess
import sys
import tempfile

import numpy as np
import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import given
import truth as T

failed = 0


def check(what, value, limit):
    global failed
    failed += not value <= limit
    print("  %-42s %10.4g  (limit %g)%s" % (what, value, limit, "" if value <= limit else "  FAILED"))


def cylinder(scene):
    del scene["post"]
    scene["sample"].update(shape="cylinder", radius=20, height=60, axis=[1, 0.1, 0])


def mosaic(scene):
    scene["sensor"] = {"mosaic": "rggb"}
    scene["files"] = "dng"
    scene["camera"].update(size=[1280, 860], center_px=[644.2, 425.2])  # a third of the photosites, for each colour


def measure(goniocam, project, folder, name, change):
    at = lambda n: os.path.join(folder, name + "-" + n)
    run = lambda *a: subprocess.check_call([goniocam, *a, "--quiet"], stdout=subprocess.DEVNULL)
    with open(os.path.join(project, "samples/tiny.yaml")) as f:
        scene = yaml.safe_load(f)
    change(scene)
    with open(at("scene.yaml"), "w") as f:
        yaml.safe_dump(scene, f)
    run("render", at("scene.yaml"), "-o", at("capture"))
    truth = T.Truth(at("capture/truth.json"))
    with open(at("calibration.yaml"), "w") as f:
        yaml.safe_dump(given.calibration(truth.t), f)
    run("reconstruct", at("capture"), "-o", at("out"), "--calibration", at("calibration.yaml"))
    error, z = truth.bins(at("out"))
    print(name)
    check("no bins measured", len(error) < 3000, 0)
    check("bins to 75 deg, median %", 100 * np.median(np.abs(error)), 1)
    check("bins to 75 deg, 95 %", 100 * np.quantile(np.abs(error), 0.95), 4)
    check("signed median, %", 100 * abs(np.median(error)), 0.2)
    check("bins beyond 2 sigma, %", 100 * (np.abs(z) > 2).mean(), 10)
    return at("out")


def main():
    goniocam, project = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        measure(goniocam, project, folder, "cylinder", cylinder)
        measure(goniocam, project, folder, "mosaic", mosaic)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
