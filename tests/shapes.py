#!/usr/bin/python3
"""Other samples and sensors: a cylinder and a ball in raw files, given the calibration; a cylinder and a mesh that stand
a millimetre and a degree from where capture.yaml has them.

    tests/shapes.py GONIOCAM PROJECT

Variations of samples/tiny.yaml, rendered and reconstructed.
"""
import os
import shutil
import subprocess
import sys
import tempfile

import cv2
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


def vase(scene):
    del scene["post"]
    scene["sample"].update(shape="mesh", file="vase.ply", center=[0, 0, 42], rotation_deg=[4, -3, 20])
    del scene["sample"]["radius"]


def misplace(path):
    """Say in capture.yaml that the sample is elsewhere, by about 1 mm and 1 degree."""
    with open(path) as f:
        capture = yaml.safe_load(f)
    s = capture["sample"]
    shift, turn = np.array([0.7, -0.5, 0.5]), np.radians([0.6, 0.5, -0.6])
    if s["shape"] == "mesh":
        center = np.array([0, 0, 42])
        r = cv2.Rodrigues(np.array(s["pose"][:3]))[0]
        wrong = cv2.Rodrigues(turn)[0]
        s["pose"] = [float(x) for x in np.r_[cv2.Rodrigues(wrong @ r)[0][:, 0],
                                             wrong @ (np.array(s["pose"][3:]) - center) + center + shift]]
    else:
        axis = cv2.Rodrigues(turn)[0] @ s["axis"]
        s["axis"], s["center"] = axis.tolist(), (np.array(s["center"]) + shift).tolist()
    with open(path, "w") as f:
        yaml.safe_dump(capture, f)


def place_of(sample):
    """Centre, and a direction that turns with the sample, of a sample in calibration.yaml or capture.yaml."""
    if sample["shape"] != "mesh":
        return np.array(sample["center"]), np.array(sample["axis"])
    turn, shift = (sample["pose"][:3], sample["pose"][3:]) if "pose" in sample else (sample["rotation"], sample["translation"])
    r = cv2.Rodrigues(np.array(turn, float))[0]
    return r @ [0, 0, 30] + shift, r[:, 2]  # vase.ply stands on its origin, along z


def placed(goniocam, project, folder, name, change):
    """The whole way, from a wrong nominal place."""
    at = lambda n: os.path.join(folder, name + "-placed-" + n)
    run = lambda *a: subprocess.check_call([goniocam, *a, "--quiet"], stdout=subprocess.DEVNULL)
    with open(os.path.join(project, "samples/tiny.yaml")) as f:
        scene = yaml.safe_load(f)
    change(scene)
    shutil.copy(os.path.join(project, "samples/vase.ply"), folder)
    with open(at("scene.yaml"), "w") as f:
        yaml.safe_dump(scene, f)
    run("render", at("scene.yaml"), "-o", at("capture"))
    with open(at("capture/capture.yaml")) as f:
        true = place_of(yaml.safe_load(f)["sample"])
    truth = T.Truth(at("capture/truth.json"))
    if scene["sample"]["shape"] == "cylinder":  # capture.yaml has its place to the millimetre only
        true = place_of(dict(truth.t["sample"], shape="cylinder"))
    misplace(at("capture/capture.yaml"))
    run("reconstruct", at("capture"), "-o", at("out"))
    center, axis = place_of(T.load(at("out/calibration.yaml"))["sample"])
    error, z = truth.bins(at("out"))
    print(name + ", misplaced")
    check("centre, mm", np.linalg.norm(center - true[0]), 0.1)
    check("axis, degrees", np.degrees(np.linalg.norm(np.cross(axis, true[1]))), 0.1)
    check("no bins measured", len(error) < 3000, 0)
    check("bins to 75 deg, median %", 100 * np.median(np.abs(error)), 1)
    check("signed median, %", 100 * abs(np.median(error)), 0.6)  # six small photographs place the lamp to 0.5 mm
    check("bins beyond 2 sigma, %", 100 * (np.abs(z) > 2).mean(), 10)


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
        placed(goniocam, project, folder, "cylinder", cylinder)
        placed(goniocam, project, folder, "vase", vase)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
