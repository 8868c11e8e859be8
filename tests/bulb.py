#!/usr/bin/python3
"""A glossy ball under a bulb of 20 mm: what its disc blunts of the highlight is undone, where capture.yaml tells its size.

    tests/bulb.py GONIOCAM PROJECT
"""
import json
import os
import subprocess
import sys
import tempfile

import h5py
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import limits
from limits import check
import truth as T


def peak(out, truth):
    """Signed median error of the bins within 2 degrees of the mirror direction, %."""
    with h5py.File(out + "/bins.h5") as f:
        seen = f["status"][...] == 1
        mean, angles = (f[k][...][seen] for k in ("mean", "centroid"))
    near = angles[:, 0] < np.radians(2)
    wi, wo = T.directions(angles[near])
    return 100 * np.median(mean[near] / T.ggx(truth.material, wi, wo) - 1)


def main():
    goniocam, project = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        at = lambda name: os.path.join(folder, name)
        run = lambda *a: subprocess.check_call([goniocam, *a, "--quiet"], stdout=subprocess.DEVNULL,
                                               stderr=subprocess.DEVNULL)
        scene = T.load(os.path.join(project, "samples/tiny.yaml"))
        scene["sample"]["material"]["alpha"] = 0.08
        scene["lights"][0]["radius"] = 20
        with open(at("scene.yaml"), "w") as f:
            json.dump(scene, f)
        run("render", at("scene.yaml"), "-o", at("capture"))
        truth = T.Truth(at("capture/truth.json"))
        text = open(at("capture/capture.yaml")).read()
        check("times capture.yaml tells the lamp's radius", text.count("radius: 20\n"), 1, 1)
        run("reconstruct", at("capture"), "-o", at("out"))
        check("light's radius in calibration.yaml, mm", T.load(at("out/calibration.yaml"))["lights"][0]["radius"], 20, 20)
        check("peak of the highlight, signed median %", peak(at("out"), truth), -1, 1)
        error, z = truth.bins(at("out"))
        check("bins to 75 deg, median %", 100 * np.median(np.abs(error)), 0, 0.7)
        with h5py.File(at("out/bins.h5")) as f:
            check("lamp's solid angle, of pi (20 / 600)^2", f.attrs["lamp_solid_angle_sr"] / (np.pi / 900), 0.95, 1.05)
        resolution = json.load(open(at("out/run.json")))["resolution"]
        check("bins that were corrected, of all", resolution["bins_corrected"] / (len(error) + 1), 0.001, 0.2)
    sys.exit(1 if limits.failed else 0)


if __name__ == "__main__":
    main()
