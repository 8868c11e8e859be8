#!/usr/bin/python3
"""Samples that are not what capture.yaml says: an ellipsoid and a dented ball are named, a true ball is not, whatever
light ends on it; a radius that nobody trusts is found.

    tests/misshapen.py GONIOCAM PROJECT

Variations of samples/tiny.yaml, rendered (as meshes) and calibrated.
"""
import os
import re
import struct
import subprocess
import sys
import tempfile

import numpy as np
import yaml

RADIUS, CENTER = 25, [-0.5, 0.4, 44.8]
failed = 0


def check(what, holds, told):
    global failed
    failed += not holds
    print("  %-60s %s%s" % (what, told, "" if holds else "  FAILED"))


def ply(path, shape, rows=180, columns=360):
    """A ball of points n RADIUS + shape(n), n unit [..][3]; its facets are flat to 0.002 mm."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rows + 1), np.arange(columns) * 2 * np.pi / columns, indexing="ij")
    n = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)
    points = n * RADIUS + shape(n)
    at = lambda i, j: i * columns + j % columns
    faces = [f for i in range(rows) for j in range(columns)
             for f in ((at(i, j), at(i + 1, j), at(i + 1, j + 1)), (at(i, j), at(i + 1, j + 1), at(i, j + 1)))]
    with open(path, "wb") as f:
        f.write(("ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
                 "property float z\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n"
                 % (len(points), len(faces))).encode())
        f.write(points.astype("<f4").tobytes())
        f.write(b"".join(struct.pack("<Biii", 3, *face) for face in faces))


def calibrate(goniocam, project, folder, name, shape, claim):
    """-> (stderr, the sample in calibration.yaml) of a ball that capture.yaml claims to be `claim`."""
    at = lambda n: os.path.join(folder, name + "-" + n)
    with open(os.path.join(project, "samples/tiny.yaml")) as f:
        scene = yaml.safe_load(f)
    del scene["post"]
    scene["sample"] = {"shape": "mesh", "file": name + ".ply", "center": CENTER, "material": scene["sample"]["material"]}
    ply(os.path.join(folder, name + ".ply"), shape)
    with open(at("scene.yaml"), "w") as f:
        yaml.safe_dump(scene, f)
    subprocess.check_call([goniocam, "render", at("scene.yaml"), "-o", at("capture"), "--quiet"], stdout=subprocess.DEVNULL)
    with open(at("capture/capture.yaml")) as f:
        capture = yaml.safe_load(f)
    capture["sample"] = dict({"shape": "sphere", "center": [0, 0, 45]}, **claim)
    with open(at("capture/capture.yaml"), "w") as f:
        yaml.safe_dump(capture, f)
    done = subprocess.run([goniocam, "calibrate", at("capture"), "-o", at("out"), "--quiet"], check=True, text=True,
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    with open(at("out/calibration.yaml")) as f:
        return done.stderr, yaml.safe_load(f)["sample"]


def warned(told, pattern):
    """Size, mm, and direction of the misfit that was warned of; None: of none, or of another."""
    found = re.search(r"but like %s: its outline is up to ([0-9.]+) \+- [0-9.]+ mm further (in|out), in the "
                      r"direction \[([-0-9., ]+)\]" % pattern, told)
    return found and (float(found[1]), np.array([float(x) for x in found[3].split(",")]))


def true_ball(goniocam, project, folder, kind, shots):
    """-> stderr of calibrating a ball that is one, in a scene of tests/bench/calibration_table.py."""
    sys.path.insert(0, os.path.join(project, "tests/bench"))
    import calibration_table
    scene = calibration_table.scene_of(calibration_table.KINDS[kind], shots)
    scene.pop("post", None)
    with open(os.path.join(folder, "ball.yaml"), "w") as f:
        yaml.safe_dump(scene, f)
    capture, out = os.path.join(folder, "ball"), os.path.join(folder, "ball-out")
    subprocess.check_call([goniocam, "render", f.name, "-o", capture, "--quiet"], stdout=subprocess.DEVNULL)
    return subprocess.run([goniocam, "calibrate", capture, "-o", out, "--quiet"], check=True, text=True,
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE).stderr


def main():
    goniocam, project = sys.argv[1:3]
    trusted = {"radius": RADIUS}
    with tempfile.TemporaryDirectory() as folder:
        run = lambda *a: calibrate(goniocam, project, folder, *a)

        print("an ellipsoid, 0.3 mm longer along x")
        told, sample = run("ellipsoid", lambda n: n * [0.3, 0, 0], trusted)
        size, way = warned(told, "an ellipsoid") or (0, np.zeros(3))
        # 0.3 (x^2 - 1/3): 0.2 mm out along x, 0.1 mm in across it
        check("0.2 mm further out", 0.15 < size < 0.25, "%.3f mm" % size)
        check("along x", abs(way[0]) > 0.9, way)

        print("a dent, 0.6 mm deep, 12 degrees wide, on the side that four of the six photographs see from beside")
        side = np.radians(285 - 90)  # of the arc's azimuth
        dent = np.array([np.cos(side), np.sin(side), 0])
        told, sample = run("dent", lambda n: -n * 0.6 * np.exp(-((1 - n @ dent) / (1 - np.cos(np.radians(12))))[:, None]),
                           trusted)
        size, way = warned(told, "a dent") or (0, np.zeros(3))
        check("further in, by a part of the depth", 0.1 < size < 0.6, "%.3f mm" % size)
        check("within 20 degrees of it", way @ dent > np.cos(np.radians(20)), way)

        print("a radius that is a millimetre wrong")
        told, sample = run("loose", lambda n: 0 * n, {"radius": RADIUS - 1, "radius_sigma": 1})
        check("no warning of its shape", "is not the" not in told, told.strip())
        check("found to 0.02 mm", abs(sample["radius"] - RADIUS) < 0.02, "%.3f mm" % sample["radius"])
        check("sigma covers it", abs(sample["radius"] - RADIUS) < 3 * sample["sigma_radius"], "%.4f" % sample["sigma_radius"])
        check("centre to 0.03 mm", np.linalg.norm(np.subtract(sample["center"], CENTER)) < 0.03, sample["center"])

        print("a true ball under a lamp at infinity, which the board alone cannot place")
        told = true_ball(goniocam, project, folder, "lamp at infinity", 14)
        check("no warning of its shape", "is not the" not in told, told.strip())
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
