#!/usr/bin/python3
"""Somebody else's calibration: distant lamps, one a shot, a camera that stands still, and no board.

    tests/infinity.py GONIOCAM PROJECT

Photographs as of photometric stereo are rendered; the calibration is written here, from the scene's own numbers.
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
# Azimuth and height of the lamps, degrees; irradiance.
LAMPS = [(0, 60), (60, 45), (120, 30), (180, 50), (240, 35), (300, 25), (20, 80), (200, 15)]
IRRADIANCE = 0.25


def check(what, value, limit):
    global failed
    failed += not value <= limit
    print("%-44s %10.4g  (limit %g)%s" % (what, value, limit, "" if value <= limit else "  FAILED"))


def way(azimuth, height):
    a, h = np.radians([azimuth, height])
    return [float(np.cos(h) * np.cos(a)), float(np.cos(h) * np.sin(a)), float(np.sin(h))]


def scene(tiny):
    with open(tiny) as f:
        s = yaml.safe_load(f)
    s["lights"] = [{"name": "l%d" % k, "distant": True, "direction": way(*lamp), "intensity": IRRADIANCE}
                   for k, lamp in enumerate(LAMPS)]
    s["shots"] = [{"look": {"eye": [60, -250, 560], "target": [0, 0, 45], "light": "l%d" % k}} for k in range(len(LAMPS))]
    return s


def main():
    goniocam, project = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        at = lambda name: os.path.join(folder, name)
        run = lambda *a: subprocess.check_call([goniocam, *a, "--quiet"], stdout=subprocess.DEVNULL)
        with open(at("scene.yaml"), "w") as f:
            yaml.safe_dump(scene(os.path.join(project, "samples/tiny.yaml")), f)
        run("render", at("scene.yaml"), "-o", at("capture"))
        truth = T.Truth(at("capture/truth.json"))
        with open(at("capture/capture.yaml"), "w") as f:
            f.write("goniocam: 1\nphotos: {pattern: shot*.tif}\n")  # nothing else is known of the scene
        with open(at("calibration.yaml"), "w") as f:
            yaml.safe_dump(given.calibration(truth.t), f)
        run("reconstruct", at("capture"), "-o", at("out"), "--calibration", at("calibration.yaml"))
        error, z = truth.bins(at("out"))
        check("no bins measured", len(error) < 5000, 0)
        check("bins to 75 deg, median %", 100 * np.median(np.abs(error)), 1)
        check("bins to 75 deg, 95 %", 100 * np.quantile(np.abs(error), 0.95), 4)
        check("signed median, %", 100 * abs(np.median(error)), 0.2)
        check("bins beyond 2 sigma, %", 100 * (np.abs(z) > 2).mean(), 10)
        cal = T.load(at("out/calibration.yaml"))
        check("lamps that are no longer at infinity", sum("direction" not in light for light in cal["lights"]), 0)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
