#!/usr/bin/python3
"""A polished ball beside the sample: found by its outline, it tells where the lamp is.

    tests/balls.py GONIOCAM PROJECT

A variation of samples/tiny.yaml, rendered and calibrated: capture.yaml has the ball a millimetre off.
"""
import json
import os
import subprocess
import sys
import tempfile

import cv2
import numpy as np
import yaml
from PIL import Image

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import limits
import truth as T
from limits import check

BALL = {"shape": "ball", "center": [-56.3, 4.4, 12.2], "radius": 12,
        "material": {"model": "ggx_conductor", "eta": [0.2, 0.92, 1.1], "k": [3.9, 2.45, 2.2], "alpha": 0.06}}


OUTLINE = [51, 153, 255]  # of the overlays


def outlined(path, cal, shot, ball):
    """The share of a ball's outline (of 36 sectors) that an overlay draws, within two pixels of a pinhole's picture."""
    camera = cal["cameras"][0]
    at = cv2.Rodrigues(np.array(shot["rotation"]))[0] @ ball["center"] + shot["translation"]
    center = np.array(camera["focal"]) * at[:2] / at[2] + camera["center"]
    radius = camera["focal"][0] * ball["radius"] / np.linalg.norm(at)
    y, x = np.nonzero(np.abs(np.asarray(Image.open(path).convert("RGB")).astype(int) - OUTLINE).sum(-1) < 100)
    off = np.stack([x, y], 1) - center
    on = np.abs(np.linalg.norm(off, axis=1) - radius) < 2
    return len(set((np.degrees(np.arctan2(off[on, 1], off[on, 0])) // 10).tolist())) / 36


def main():
    goniocam, project = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        at = lambda n: os.path.join(folder, n)
        run = lambda *a: subprocess.run([goniocam, *a, "--quiet"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                        text=True, check=True).stderr
        with open(os.path.join(project, "samples/tiny.yaml")) as f:
            scene = yaml.safe_load(f)
        scene["things"] = [BALL]
        with open(at("scene.yaml"), "w") as f:
            yaml.safe_dump(scene, f)
        run("render", at("scene.yaml"), "-o", at("capture"))
        with open(at("capture/capture.yaml")) as f:
            capture = yaml.safe_load(f)
        capture["balls"] = [{"radius": 12, "center": (np.array(BALL["center"]) + [0.7, -0.5, 0.6]).tolist()}]
        with open(at("capture/capture.yaml"), "w") as f:
            yaml.safe_dump(capture, f)
        warnings = run("calibrate", at("capture"), "-o", at("out"))
        with open(at("capture/truth.json")) as f:
            truth = json.load(f)
        cal = T.load(at("out/calibration.yaml"))
        drawn = [outlined(at("out/overlay/%s.png" % shot["name"]), cal, shot, cal["balls"][0]) for shot in cal["shots"]]
    lamp, center = np.array(truth["lights"][0]["position"]), np.array(truth["sample"]["center"])
    towards = (lamp - center) / np.linalg.norm(lamp - center)
    cues = {c["cue"]: c for c in cal["lights"][0]["cues"]}
    ball = cal["balls"][0]
    check("ball's centre, mm (two pixels each)", np.linalg.norm(np.subtract(ball["center"], BALL["center"])), 0, 0.25)
    check("the same, sigmas", np.max(np.abs(np.subtract(ball["center"], BALL["center"])) / ball["sigma_center"]), 0, 3)
    off = np.linalg.norm(cues["ball"]["direction"] - towards)
    check("lamp by the ball, degrees", np.degrees(off), 0, 1.5)
    check("the same, sigmas", off / cues["ball"]["sigma_direction"], 0, 3)
    check("lamp by all, mm", np.linalg.norm(np.subtract(cal["lights"][0]["position"], lamp)), 0, 1.5)
    check("sample's centre, mm", np.linalg.norm(np.subtract(cal["sample"]["center"], center)), 0, 0.05)
    check("the sample has no sigmas", 0 if min(cal["sample"].get("sigma_center", [0])) > 0 else 1, 0, 0)
    check("outline of the ball in overlays, share", np.mean(drawn), 0.8, 1)
    check("warnings", len(warnings.splitlines()), 0, 0)
    sys.exit(1 if limits.failed else 0)


if __name__ == "__main__":
    main()
