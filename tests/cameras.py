#!/usr/bin/python3
"""Cameras and boards for their own sake: layouts that nobody measured or measured badly, zooms, intrinsics from files of
other programs, a calibration checked with new photographs.

    tests/cameras.py GONIOCAM PROJECT

samples/tiny.yaml, one exposure a shot, without sample and patch in capture.yaml.
"""
import os
import subprocess
import sys
import tempfile

import numpy as np
import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import truth as T

failed = 0


def check(what, value, limit):
    global failed
    failed += not value <= limit
    print("  %-56s %10.4g  (limit %g)%s" % (what, value, limit, "" if value <= limit else "  FAILED"))


class Bench:
    def __init__(self, goniocam, folder):
        self.goniocam, self.folder = goniocam, folder

    def at(self, name):
        return os.path.join(self.folder, name)

    def run(self, *args):
        """-> exit code, stdout, stderr."""
        done = subprocess.run([self.goniocam, *args, "--quiet"], capture_output=True, text=True)
        return done.returncode, done.stdout, done.stderr

    def render(self, project, name, focal_length, shots=None):
        with open(os.path.join(project, "samples/tiny.yaml")) as f:
            scene = yaml.safe_load(f)
        scene["camera"]["focal_length"] = focal_length
        scene["exposures"] = [0.015625]
        scene["shots"] = shots or scene["shots"]
        with open(self.at("scene.yaml"), "w") as f:
            yaml.safe_dump(scene, f)
        assert self.run("render", self.at("scene.yaml"), "-o", self.at(name))[0] == 0

    def variant(self, name, change, also=(), of="tiny"):
        """The photographs of `tiny` (and of other renderings, their names prefixed) under another capture.yaml."""
        capture = T.load(self.at(of + "/capture.yaml"))
        for key in ("sample", "reference", "lights", "photos"):
            capture.pop(key, None)
        capture["noise"] = {"black": 128, "white": 4095, "gain": 12.5, "read_noise": 5}  # no brackets tell them
        change(capture)
        os.mkdir(self.at(name))
        for source, prefix in [(of, ""), *also]:
            for photo in os.listdir(self.at(source)):
                if photo.endswith(".tif"):
                    os.link(self.at(source + "/" + photo), self.at(name + "/" + prefix + photo))
        with open(self.at(name + "/capture.yaml"), "w") as f:
            yaml.safe_dump(capture, f)

    def calibrate(self, name, change, also=(), of="tiny"):
        """-> calibration, what was said on stderr."""
        self.variant(name, change, also, of)
        code, _, said = self.run("calibrate", self.at(name), "-o", self.at(name + "-out"))
        assert code == 0, said
        return T.load(self.at(name + "-out/calibration.yaml")), said


def rotation(v):
    angle = np.linalg.norm(v)
    x, y, z = np.asarray(v) / max(angle, 1e-300)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def eyes_off(calibration, truth, aligned=False):
    """Largest distance of the cameras from the truth, mm; aligned: after the best rigid motion."""
    found, true = [], []
    for shot in calibration["shots"]:
        found.append(-rotation(shot["rotation"]).T @ shot["translation"])
        true.append(truth.t["shots"][int(shot["name"][-7:-5])]["eye"])
    found, true = np.array(found), np.array(true)
    if aligned:
        a, b = found - found.mean(0), true - true.mean(0)
        u, _, v = np.linalg.svd(b.T @ a)
        found = a @ (u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v).T + true.mean(0)
    return np.linalg.norm(found - true, axis=1).max()


def layouts(b, truth):
    print("layouts")
    measured, said = b.calibrate("measured", lambda c: None)
    check("measured: warnings", len(said), 0)
    check("measured: cameras, mm", eyes_off(measured, truth), 0.2)

    def by_size(c):
        c["board"] = {"family": "tag36h11", "tag_size": 30}

    found, _ = b.calibrate("by-size", by_size)
    check("tag size alone: cameras, mm", eyes_off(found, truth, aligned=True), 0.2)
    check("tag size alone: focal length", abs(found["cameras"][0]["focal"][0] / 1280 - 1), 5e-4)
    tags = {t["id"]: np.array(t["center"]) for t in found["board"]["tags"]}
    check("tag size alone: tag 0 begins the world", np.linalg.norm(tags[0]), 0)
    check("tag size alone: tags 0 and 13 apart, mm", abs(np.linalg.norm(tags[13] - tags[0]) - np.hypot(184, 138)), 0.05)

    def ruler(c):
        random = np.random.default_rng(3)
        for tag in c["board"]["tags"]:
            tag["center"] = [float(x + e) for x, e in zip(tag["center"], [*random.normal(0, 0.3, 2), 0])]

    found, said = b.calibrate("ruler", ruler)
    check("a ruler's board: cameras, mm", eyes_off(found, truth, aligned=True), 0.4)
    check("a ruler's board is told", "places were adjusted" not in said, 0)

    def wrong(c):
        c["board"]["tags"][3]["size"] = 32
        c["board"]["tags"][6]["center"][1] += 5

    found, said = b.calibrate("wrong", wrong)
    check("a wrong size and a wrong place: cameras, mm", eyes_off(found, truth), 0.3)
    check("both are named", ("tag 3 is 30.0" not in said) + ("tag 6 is in (92.0" not in said), 0)


def intrinsics(b, truth):
    print("intrinsics from files")
    b.run("export-calibration", b.at("measured-out/calibration.yaml"), "--to", "opencv", "-o", b.at("lens.yml"))
    b.run("export-calibration", b.at("measured-out/calibration.yaml"), "--to", "colmap", "-o", b.at("colmap"))
    camera = T.load(b.at("measured-out/calibration.yaml"))["cameras"][0]
    with open(b.at("kalibr.yaml"), "w") as f:
        yaml.safe_dump({"cam0": {"camera_model": "pinhole", "intrinsics": camera["focal"] + camera["center"],
                                 "distortion_model": "radtan", "distortion_coeffs": camera["distortion"][:4],
                                 "resolution": [640, 430], "rostopic": "/cam0"}}, f)
    for file in ("lens.yml", "colmap/cameras.txt", "kalibr.yaml", "measured-out/calibration.yaml", "measured-out"):
        found, _ = b.calibrate("given-" + file.replace("/", "-"), lambda c: c.update(camera={"intrinsics": b.at(file)}))
        check(file + ": focal length kept", np.abs(np.subtract(found["cameras"][0]["focal"], camera["focal"])).max(), 1e-9)
        check(file + ": cameras, mm", eyes_off(found, truth), 0.3)
    found, _ = b.calibrate("given-by-capture", lambda c: c.update(camera={"intrinsics": b.at("measured")}))
    check("a capture folder: focal length kept", abs(found["cameras"][0]["focal"][0] - camera["focal"][0]), 1e-9)
    b.variant("chain", lambda c: c.update(camera={"intrinsics": b.at("given-by-capture")}))
    code, _, said = b.run("calibrate", b.at("chain"), "-o", b.at("chain-out"))
    check("a chain of captures is refused", (code != 1) + ("names another one" not in said), 0)
    code, _, _ = b.run("import-calibration", b.at("colmap"), "-o", b.at("imported.yaml"))
    imported = T.load(b.at("imported.yaml"))
    check("COLMAP's model read back: cameras, mm", eyes_off(imported, truth) if code == 0 else np.inf, 0.2)
    found, _ = b.calibrate("prior", lambda c: c.update(camera={"intrinsics": b.at("measured-out/calibration.yaml"),
                                                               "use": "prior"}))
    check("as a prior, sigma of the focal length over before", found["cameras"][0]["sigma_focal"][0]
          / camera["sigma_focal"][0], 0.8)  # the same photographs once more: 1 / sqrt(2)


def checks(b):
    print("checks")
    code, told, said = b.run("calibrate", b.at("measured"), "-o", b.at("check"), "--check", b.at("lens.yml"))
    check("its own photographs: exit code", code, 0)
    check("its own photographs: holds", "holds" not in told, 0)
    with open(b.at("lens.yml")) as f:
        lens = f.read()
    focal = "%.17g" % T.load(b.at("measured-out/calibration.yaml"))["cameras"][0]["focal"][0]
    assert focal in lens
    with open(b.at("other.yml"), "w") as f:
        f.write(lens.replace(focal, "1300.0"))
    code, told, _ = b.run("calibrate", b.at("measured"), "-o", b.at("check2"), "--check", b.at("other.yml"))
    check("another lens: exit code is 1", abs(code - 1), 0)
    check("another lens: does not hold", "does not hold" not in told, 0)


def zooms(b, project):
    print("two focal lengths in one folder")
    b.render(project, "zoomed", 60)
    found, _ = b.calibrate("both", lambda c: None, also=[("zoomed", "z_")])
    focal = sorted(c["focal"][0] for c in found["cameras"])
    check("cameras", abs(len(focal) - 2), 0)
    check("focal lengths", max(abs(focal[0] / 1280 - 1), abs(focal[-1] / 1536 - 1)), 5e-4)

    def hide(c):
        c["overrides"] = [{"photos": "*", "focal_length": 50}]

    found, said = b.calibrate("hidden", hide, also=[("zoomed", "z_")])
    focal = sorted(c["focal"][0] for c in found["cameras"])
    check("not told by EXIF: cameras", abs(len(focal) - 2), 0)
    check("not told by EXIF: focal lengths", max(abs(focal[0] / 1280 - 1), abs(focal[-1] / 1536 - 1)), 5e-4)
    check("not told by EXIF: said", "zoomed or focused anew" not in said, 0)


def turntable(b, project):
    print("a turntable before a tripod, from one height")
    ring = {"count": 6, "turns": 1, "azimuth_deg": 285, "elevation_deg": [42, 42], "distance": 640, "target": [0, 0, 25]}
    b.render(project, "turned", 50, [{"spiral": ring}])
    found, said = b.calibrate("one-height", lambda c: None, of="turned")
    check("what it leaves open is told", "at the same slant" not in said, 0)
    camera = found["cameras"][0]
    off = abs(camera["focal"][0] - 1280)  # its sigma, 0.4 %, is what is known of cameras in general
    check("focal length, sigmas", off / camera["sigma_focal"][0], 2.5)
    check("its sigma, parts", camera["sigma_focal"][0] / 1280, 0.01)


def main():
    goniocam, project = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        b = Bench(goniocam, folder)
        b.render(project, "tiny", 50)
        truth = T.Truth(b.at("tiny/truth.json"))
        layouts(b, truth)
        intrinsics(b, truth)
        checks(b)
        zooms(b, project)
        turntable(b, project)
    return failed > 0


sys.exit(main())
