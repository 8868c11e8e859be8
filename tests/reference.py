#!/usr/bin/python3
"""No white patch beside the sample: a second capture of the same lamp and camera gives the scale.

    tests/reference.py GONIOCAM PROJECT

The lamp is moved between the two. The reference is a patch beside a ball, a patch alone, or a ball of known albedo.
"""
import json
import os
import subprocess
import sys
import tempfile

import h5py
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import given
import limits
from limits import check
import truth as T


def edit(capture, **keys):
    """Set keys of a capture.yaml, or (None) take them away."""
    text = T.load(capture + "/capture.yaml")
    text.update(keys)
    with open(capture + "/capture.yaml", "w") as f:
        json.dump({k: v for k, v in text.items() if v is not None}, f)


def main():
    goniocam, project = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        at = lambda name: os.path.join(folder, name)

        def run(*a):
            return subprocess.run([goniocam, *a, "--quiet"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)

        def render(name, change):
            scene = T.load(os.path.join(project, "samples/tiny.yaml"))
            scene["exposures"] = scene["exposures"][1:]
            change(scene)
            with open(at(name + ".yaml"), "w") as f:
                json.dump(scene, f)
            assert run("render", at(name + ".yaml"), "-o", at(name)).returncode == 0

        def lamp(out):
            assert run("calibrate", at("main"), "-o", at(out)).returncode == 0, out
            light = T.load(at(out + "/calibration.yaml"))["lights"][0]
            return np.array(light["intensity"]), np.array(light["sigma_intensity"])

        def moved(scene):
            scene["lights"][0].update(azimuth_deg=245, elevation_deg=48, distance=520)
            scene["seed"] = 4

        def white_ball(scene):
            moved(scene)
            scene["sample"]["material"] = {"model": "lambert", "albedo": 0.9}

        render("main", lambda scene: None)
        render("patch", moved)
        render("ball", white_ball)
        truth = T.Truth(at("main/truth.json"))
        expected = given.FULL_SCALES * np.array(truth.t["lights"][0]["intensity"])
        edit(at("main"), reference={"capture": "../patch"})

        done = run("reconstruct", at("main"), "-o", at("out"))
        check("exit code", done.returncode, 0, 0)
        light = T.load(at("out/calibration.yaml"))["lights"][0]
        off = np.log(np.array(light["intensity"]) / expected)
        sigma = np.array(light["sigma_intensity"]) / light["intensity"]
        check("intensity, off by % at most", 100 * np.abs(off).max(), 0, 0.6)
        check("its own sigma, %", 100 * sigma.max(), 0.02, 1)
        check("intensity, off by sigmas at most", np.abs(off / sigma).max(), 0, 3)
        error, z = truth.bins(at("out"))
        check("bins, signed median %", 100 * np.median(error), -0.6, 0.6)
        check("bins beyond 2 sigma, %", 100 * (np.abs(z) > 2).mean(), 0, 10)

        edit(at("patch"), overrides=[{"photos": "*", "iso": 200}])  # half of what it saw was its sensor's
        half = lamp("iso")
        check("at half the ISO, half the intensity, off by %", 100 * np.abs(2 * half[0] / expected - 1).max(), 0, 0.6)
        check("which ISO numbers tell to, %", 100 * (half[1] / half[0]).max(), 1.5, 2.5)

        edit(at("patch"), overrides=None, sample=None)
        alone, sigma = lamp("alone")
        check("by a patch alone, off by %", 100 * np.abs(alone / expected - 1).max(), 0, 3)
        check("in sigmas", np.abs((alone - expected) / sigma).max(), 0, 3)

        edit(at("ball"), reference=None)
        edit(at("main"), reference={"capture": "../ball", "albedo": 0.9})
        ball, sigma = lamp("by_ball")
        check("by a white ball, off by %", 100 * np.abs(ball / expected - 1).max(), 0, 1)
        check("in sigmas", np.abs((ball - expected) / sigma).max(), 0, 3)

        run("reconstruct", at("main"), "-o", at("by_ball"))
        with h5py.File(at("by_ball/bins.h5")) as f:
            check("the scale's albedo in bins.h5", f.attrs.get("reference_albedo", 0), 0.9, 0.9)

        def refused(name, *words):
            done = run("calibrate", at("main"), "-o", at("refused"))
            lines = [line for line in done.stderr.splitlines() if "warning" not in line]
            check(name + ": refused in one line", done.returncode == 1 and len(lines) == 1
                  and all(w in lines[0] for w in words), 1, 1)
            print("    " + "\n    ".join(lines))

        edit(at("main"), reference={"capture": "../ball"})
        refused("no patch there", "ball", "no `reference` patch", "albedo")
        edit(at("ball"), reference={"capture": "../patch"})
        refused("a chain", "ball", "names another one")
        edit(at("ball"), reference=None, overrides=[{"photos": "*", "focal_length": 85}])
        edit(at("main"), reference={"capture": "../ball", "albedo": 0.9})
        refused("another lens", "ball", "another focal length")
        edit(at("ball"), overrides=None, board=None)
        refused("no board there", "ball", "board")
        edit(at("main"), reference={"capture": "nowhere"})
        refused("no such folder", "capture.yaml", "reference[0].capture", "no capture")
    sys.exit(1 if limits.failed else 0)


if __name__ == "__main__":
    main()
