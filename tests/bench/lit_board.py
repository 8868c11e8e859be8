#!/usr/bin/python3
"""A ball over a lit board, from mirror-like to matt: is the lamp found, and do its sigmas and warnings tell the truth?

    tests/bench/lit_board.py [--goniocam build/release/goniocam] [--keep FOLDER] [--bounces 2] [NAME...]

Every scene is samples/tiny.yaml with another material, board and ball throwing light on each other. Prints, of each, the
error of the lamp's place in mm and in sigmas (the root of its squared errors over their sum of variances), that of the
ball's centre, and the warnings of calibrate. NAME: plastic-ALPHA, metal-ALPHA, lambert-ALBEDO; default: those of SWEEP.
--keep: captures stay there and are rendered only once.
"""
import argparse
import json
import os
import subprocess
import tempfile

import numpy as np
import yaml

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
ALPHAS = (0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 0.4)
SWEEP = ["%s-%g" % (kind, alpha) for kind in ("plastic", "metal") for alpha in ALPHAS] + [
    "lambert-0.9", "lambert-0.5", "lambert-0.1"]


def material(name):
    kind, number = name.rsplit("-", 1)
    if kind == "lambert":
        return {"model": "lambert", "albedo": [float(number), 0.94 * float(number), 0.89 * float(number)]}
    if kind == "metal":
        return {"model": "ggx_conductor", "eta": [0.2, 0.92, 1.1], "k": [3.9, 2.45, 2.2], "alpha": float(number)}
    return {"model": "ggx", "albedo": [0.12, 0.24, 0.33], "alpha": float(number), "ior": 1.5}


def render(goniocam, name, bounces, capture):
    scene = yaml.safe_load(open(os.path.join(TOP, "samples/tiny.yaml")))
    scene["sample"]["material"] = material(name)
    scene["bounces"] = bounces
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        json.dump(scene, file)
        file.flush()
        subprocess.check_call([goniocam, "render", file.name, "-o", capture, "--quiet"], stdout=subprocess.DEVNULL)


def off(found, sigma, true):
    """Distance, mm and sigmas."""
    distance = np.linalg.norm(np.subtract(found, true))
    return distance, distance / np.linalg.norm(sigma)


def trip(goniocam, capture, out):
    done = subprocess.run([goniocam, "calibrate", capture, "-o", out, "--quiet"], stdout=subprocess.DEVNULL,
                          stderr=subprocess.PIPE, text=True)
    if done.returncode:
        return done.stderr
    truth = json.load(open(os.path.join(capture, "truth.json")))
    cal = yaml.load(open(os.path.join(out, "calibration.yaml")), getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    lamp, ball = cal["lights"][0], cal["sample"]
    if "position" not in lamp:
        return "lamp at infinity"
    row = off(lamp["position"], lamp["sigma_position"], truth["lights"][0]["position"])
    row += off(ball["center"], ball["sigma_center"], truth["sample"]["center"])
    warnings = [line.split("warning: ")[-1] for line in done.stderr.splitlines() if "warning" in line]
    return "%8.2f %6.1f %8.4f %6.1f  %s" % (*row, " | ".join(warnings) or "-")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--goniocam", default=os.path.join(TOP, "build/release/goniocam"))
    parser.add_argument("--keep")
    parser.add_argument("--bounces", type=int, default=2)
    parser.add_argument("names", nargs="*", default=SWEEP)
    a = parser.parse_args()
    print("%-14s %8s %6s %8s %6s  %s" % ("", "lamp mm", "sigmas", "ball mm", "sigmas", "warnings"))
    for name in a.names or SWEEP:
        with tempfile.TemporaryDirectory() as folder:
            capture = os.path.join(a.keep or folder, "%s-%d" % (name, a.bounces))
            if not os.path.exists(capture):
                render(a.goniocam, name, a.bounces, capture)
            print("%-14s %s" % (name, trip(a.goniocam, capture, os.path.join(folder, "out"))), flush=True)


if __name__ == "__main__":
    main()
