#!/usr/bin/python3
"""Are the standard deviations in calibration.yaml true? Errors over their own sigmas, on many small captures.

    tests/bench/calibration_sigmas.py [--goniocam build/release/goniocam] [--captures 50] [--kind KIND]... [--keep DIR]

Renders variations of samples/tiny.yaml (seed, camera, cameras' places, lamp, power, sample, material), calibrates
each, and prints for every kind of quantity how many of the estimates lie within one and two sigmas of the truth
(0.68 and 0.95 are true sigmas; issue 5 asks for 0.90 to 0.98 within two), and the errors themselves. Below, the same of
what each cue alone says of the lamp: its direction, and its distance; and the warnings that there were, for none is due.
"""
import argparse
import json
import os
import random
import subprocess
import sys
import tempfile

import numpy as np
import yaml

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
MATERIALS = {
    "lambert": lambda r: {"model": "lambert", "albedo": [round(r.uniform(0.1, 0.6), 3) for _ in range(3)]},
    "rough": lambda r: {"model": "ggx", "albedo": [round(r.uniform(0.05, 0.5), 3) for _ in range(3)],
                        "alpha": r.uniform(0.25, 0.5), "ior": 1.5},
    "glossy": lambda r: {"model": "ggx", "albedo": [round(r.uniform(0.05, 0.5), 3) for _ in range(3)],
                         "alpha": r.uniform(0.06, 0.2), "ior": r.uniform(1.4, 1.7)},
}
CAMERAS = ("tele", "wide", "raw", "portrait", "soft")
KINDS = ("lambert", "rough", "glossy", "camera-lamp", "distant-lamp", "no-flat", "turntable", "small-ball") + CAMERAS
RAW = {"mosaic": "rggb", "electrons": 3e7, "dn_per_electron": 0.3, "full_well": 45000, "read_noise": 3, "black_level": 512,
       "adc_max": 14000, "channel_gain": [0.55, 1, 0.7]}


def scene_of(kind, seed):
    """A scene like tiny.yaml; everything that may differ between captures does."""
    r = random.Random(seed)
    with open(os.path.join(TOP, "samples/tiny.yaml")) as f:
        s = yaml.safe_load(f)
    s["seed"], s["name"] = seed, "%s-%d" % (kind, seed)
    s["camera"].update(focal_length=r.uniform(44, 58),
                       center_px=[320 + r.uniform(-8, 8), 214 + r.uniform(-8, 8)],
                       distortion=[r.uniform(-0.12, 0.03), r.uniform(-0.05, 0.08), r.uniform(-6e-4, 6e-4),
                                   r.uniform(-6e-4, 6e-4), 0])
    far = s["camera"]["focal_length"] / 50
    lamp = s["lights"][0]
    lamp.update(azimuth_deg=r.uniform(230, 310), elevation_deg=r.uniform(25, 60), distance=r.uniform(450, 800))
    if kind == "camera-lamp":
        s["lights"] = [{"name": "lamp", "on_camera": True, "intensity": 1e5,
                        "position": [r.uniform(-150, 150), r.uniform(-150, -60), r.uniform(-20, 20)]}]
    if kind == "distant-lamp":
        s["lights"] = [{"name": "lamp", "distant": True, "intensity": 0.28,
                        "azimuth_deg": r.uniform(230, 310), "elevation_deg": r.uniform(25, 60)}]
    s["camera"]["vignetting"] = [-0.12, 0.02, 0] if kind == "no-flat" else [0, 0, 0]
    s["power_jitter"] = 0.02
    s["handheld"] = {"place": 12, "aim_deg": 0.5, "roll_deg": 4}
    s["sample"]["center"] = [r.uniform(-1.5, 1.5), r.uniform(-1.5, 1.5), 45 + r.uniform(-1, 1)]
    s["sample"]["nominal_center"] = [0, 0, 45]
    family = kind if kind in MATERIALS else r.choice(sorted(MATERIALS))
    s["sample"]["material"] = MATERIALS[family](r)
    low = r.uniform(36, 46)
    s["shots"] = [
        {"arc": {"count": 5, "azimuth_deg": r.uniform(260, 300), "elevation_deg": [low, low + 92],
                 "distance": 640 * far, "target": [0, 0, 25]}},
        {"look": {"eye": [330 * far, -390 * far, 420 * far], "target": [0, 0, 20]}},
        {"look": {"eye": [-360 * far, 200 * far, 480 * far], "target": [0, 0, 20]}},
        {"look": {"eye": [-250 * far, -420 * far, 400 * far], "target": [0, 0, 20], "roll_deg": 90}}]
    if kind == "turntable":  # board, sample and lamp turn before a camera on a tripod: from the board, it goes around
        s.pop("handheld")
        s["shots"] = [{"spiral": {"count": 12, "turns": 1, "azimuth_deg": 285, "elevation_deg": [low, low],
                                  "distance": 640 * far, "target": [0, 0, 25]}}]
    if kind == "small-ball":
        s["sample"].update(radius=6, center=[r.uniform(-1, 1), r.uniform(-1, 1), 15 + r.uniform(-0.5, 0.5)],
                           nominal_center=[0, 0, 15])
        s["post"] = {"radius": 1.5}
    return other_camera(kind, s) if kind in CAMERAS else s


def other_camera(kind, s):
    """Lenses of 200 and 28 mm (from where the board fills the image), a mosaic, an upright image, a soft lens."""
    camera = s["camera"]
    zoom = {"tele": 200, "wide": 28}.get(kind, camera["focal_length"] * (0.67 if kind == "portrait" else 1))
    for shot in s["shots"]:
        if "arc" in shot:
            shot["arc"]["distance"] *= zoom / camera["focal_length"]
        else:
            shot["look"]["eye"] = [x * zoom / camera["focal_length"] for x in shot["look"]["eye"]]
    if kind == "wide":
        camera["distortion"] = [-0.25, 0.1, 4e-4, -3e-4, 0]
    if kind == "portrait":
        camera.update(size=[430, 640], center_px=[214, 322], sensor_width=16.8)
    if kind == "soft":
        camera["blur_px"] = 0.6
    if kind == "raw":
        s.update(sensor=RAW, files="dng")
    camera["focal_length"] = zoom
    return s


def run(goniocam, scene, folder):
    """-> (truth, calibration) of one capture."""
    path = os.path.join(folder, scene["name"])
    if not os.path.exists(path + "/capture/truth.json"):
        os.makedirs(path)
        with open(path + "/scene.yaml", "w") as f:
            yaml.safe_dump(scene, f)
        subprocess.check_call([goniocam, "render", path + "/scene.yaml", "-o", path + "/capture", "--quiet"],
                              stdout=subprocess.DEVNULL)
    done = subprocess.run([goniocam, "calibrate", path + "/capture", "-o", path + "/out", "--quiet"],
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, universal_newlines=True)
    if done.returncode:
        raise RuntimeError(done.stderr.strip())
    for line in done.stderr.splitlines():
        print("%s: %s" % (scene["name"], line[:170]), flush=True)
    with open(path + "/capture/truth.json") as f, open(path + "/out/calibration.yaml") as g:
        return json.load(f), yaml.safe_load(g)


def rotation_vector(r, near):
    """Rodrigues' vector of a rotation matrix; of those that are a turn apart, the one near `near`."""
    r = np.asarray(r)
    axis = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    sine = np.linalg.norm(axis)
    angle = np.arctan2(sine, np.trace(r) - 1)
    return min((axis / sine * (angle + turn) for turn in (-2 * np.pi, 0, 2 * np.pi)),
               key=lambda v: np.linalg.norm(v - near))


def quantities(truth, c):
    """(quantity, errors, sigmas), a row for each thing estimated."""
    camera, true = c["cameras"][0], truth["camera"]
    yield "fx, %", [100 * (camera["focal"][0] / true["fx"] - 1)], [100 * camera["sigma_focal"][0] / true["fx"]]
    yield "centre, px", np.subtract(camera["center"], [true["cx"], true["cy"]]), camera["sigma_center"]
    by_name = {os.path.splitext(t["exposures"][0]["file"])[0]: t for t in truth["shots"]}
    for shot in c["shots"]:
        t = by_name[os.path.splitext(shot["name"])[0]]
        yield "rotation, deg", np.degrees(shot["rotation"] - rotation_vector(t["R"], shot["rotation"])), np.degrees(shot["sigma_rotation"])
        yield "translation, mm", np.subtract(shot["translation"], t["t"]), shot["sigma_translation"]
    yield "sample centre, mm", np.subtract(c["sample"]["center"], truth["sample"]["center"]), c["sample"]["sigma_center"]
    yield "sample radius, mm", [c["sample"]["radius"] - truth["sample"]["radius"]], [c["sample"]["sigma_radius"]]
    lamp, true = c["lights"][0], truth["lights"][0]
    if "position" in lamp:
        yield "lamp, mm", np.subtract(lamp["position"], true["position"]), lamp["sigma_position"]
    else:
        way = true.get("direction") or list(np.array(true["position"]) / np.linalg.norm(true["position"]))
        yield "lamp direction, deg", np.degrees(np.subtract(lamp["direction"], way)), np.degrees(lamp["sigma_direction"])


def cues(truth, c):
    """The same of what each cue says alone: direction across the lamp's way, from the sample, and distance."""
    lamp, true = c["lights"][0], truth["lights"][0]
    if true.get("frame") == "camera":
        return
    way = np.array(true.get("direction") or np.subtract(true["position"], truth["sample"]["center"]))
    distance = np.linalg.norm(way)
    side = np.cross(way, [0, 0, 1]) / np.linalg.norm(np.cross(way, [0, 0, 1]))
    across = [side, np.cross(side, way / distance)]
    for cue in lamp.get("cues", []):
        yield cue["cue"] + " alone, deg", np.degrees(across @ np.array(cue["direction"])), [np.degrees(cue["sigma_direction"])] * 2
        if cue.get("distance") and "position" in true:
            yield cue["cue"] + " alone, mm", [cue["distance"] - distance], [cue["sigma_distance"]]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--goniocam", default=os.path.join(TOP, "build/release/goniocam"))
    parser.add_argument("--captures", type=int, default=50)
    parser.add_argument("--first", type=int, default=1, help="first seed")
    parser.add_argument("--kind", action="append", choices=KINDS, help="default: lambert, rough and glossy by turns")
    parser.add_argument("--keep", help="folder to leave the captures in, and to find them in again")
    parser.add_argument("--verbose", action="store_true", help="print what is more than 4 sigmas off")
    a = parser.parse_args()
    kinds = a.kind or ["lambert", "rough", "glossy"]
    rows, failed = {}, 0
    with tempfile.TemporaryDirectory() as scratch:
        for i in range(a.captures):
            kind = kinds[i % len(kinds)]
            try:
                found = run(a.goniocam, scene_of(kind, a.first + i), a.keep or scratch)
            except RuntimeError as e:
                failed += 1
                print("%s %d: %s" % (kind, a.first + i, e), file=sys.stderr)
                continue
            for what, error, sigma in [*quantities(*found), *cues(*found)]:
                if a.verbose and np.any(np.abs(error) > 4 * np.asarray(sigma)):
                    print(kind, a.first + i, what, np.asarray(error), np.asarray(sigma))
                rows.setdefault((kind, what), []).extend(zip(error, sigma))
    print("%-14s %-22s %6s %12s %12s %10s %10s" % ("kind", "quantity", "count", "median |e|", "rms error", "in 1 sigma",
                                                   "in 2 sigma"))
    bad = failed
    every = {}
    for (kind, what), pairs in rows.items():
        every.setdefault(("all", what), []).extend(pairs)
    for (kind, what), pairs in list(rows.items()) * (len(kinds) > 1) + list(every.items()):
        e, s = np.array(pairs).T
        z = np.abs(e) / np.maximum(s, 1e-300)
        inside = (z < 2).mean()
        print("%-14s %-22s %6d %12.5g %12.5g %10.3f %10.3f" % (kind, what, len(e), np.median(np.abs(e)),
                                                              np.sqrt((e ** 2).mean()), (z < 1).mean(), inside))
        asked = "alone" not in what and not what.startswith("sample radius")
        bad += kind == "all" and asked and not 0.90 <= inside <= 0.98
    print("%d captures failed" % failed)
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
