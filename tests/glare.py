#!/usr/bin/python3
"""A lens that spreads 2 % of the light over the image: what it does to the darkest samples, before and after removal.

    tests/glare.py GONIOCAM PROJECT
"""
import os
import subprocess
import sys
import tempfile

import h5py
import numpy as np
import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import limits
from limits import check
import truth as T
from samples_file import local


def bias_of_darkest(out, material):
    """Of the decile of samples whose true radiance under even light is lowest: mean seen / mean true - 1, per channel."""
    with h5py.File(os.path.join(out, "samples.h5")) as f:
        s = {k: np.concatenate([f[shot][k][...].astype(float) for shot in f]) for k in ("f", "wi", "wo", "normal")}
    wi, wo = local(s["wi"], s["normal"]), local(s["wo"], s["normal"])
    due = T.ggx(material, wi, wo) * wi[:, 2:]
    seen = s["f"] * wi[:, 2:]
    dark = due.mean(1) < np.quantile(due.mean(1), 0.1)
    return seen[dark].mean(0) / due[dark].mean(0) - 1


def main():
    goniocam, project = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        at = lambda n: os.path.join(folder, n)
        run = lambda *a: subprocess.check_call([goniocam, *a, "--quiet"], stdout=subprocess.DEVNULL)
        with open(os.path.join(project, "samples/tiny.yaml")) as f:
            scene = yaml.safe_load(f)

        def capture(name, glare):
            scene["camera"].update(glare=glare, blur_px=0.4)
            with open(at(name + ".yaml"), "w") as f:
                yaml.safe_dump(scene, f)
            run("render", at(name + ".yaml"), "-o", at(name))

        capture("veiled", 0.02)
        run("reconstruct", at("veiled"), "-o", at("cleared"), "--samples")
        found = T.load(at("cleared/calibration.yaml"))
        material = T.Truth(at("veiled/truth.json")).material
        total = sum(found["shots"][0].get("glare", [0]))
        check("share of light spread, found (0.02 was put in)", total, 0.019, 0.021)
        check("  off by, in its own sigmas", abs(total - 0.02) / found["shots"][0]["sigma_glare"], 0, 3)
        after = bias_of_darkest(at("cleared"), material)
        # The same calibration, and nothing taken off.
        for shot in found["shots"]:
            shot.pop("glare"), shot.pop("sigma_glare")
        with open(at("blind.yaml"), "w") as f:
            yaml.safe_dump(found, f)
        run("reconstruct", at("veiled"), "-o", at("blind"), "--samples", "--calibration", at("blind.yaml"))
        before = bias_of_darkest(at("blind"), material)
        check("darkest decile of samples, bias in %, as photographed", 100 * np.abs(before).max(), 4, 100)
        check("darkest decile of samples, bias in %, glare taken off", 100 * np.abs(after).max(), 0, 2)

        capture("clear", 0)
        run("merge", at("clear"), "-o", at("none"))
        run("calibrate", at("clear"), "-o", at("none"))
        check("a lens without glare: share that is taken off", sum(
            sum(s.get("glare", [0])) for s in T.load(at("none/calibration.yaml"))["shots"]), 0, 0)
    sys.exit(1 if limits.failed else 0)


if __name__ == "__main__":
    main()
