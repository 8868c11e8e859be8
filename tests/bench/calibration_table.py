#!/usr/bin/python3
"""Errors of calibrations over captures of many kinds, and the cues that carried each lamp.

    tests/bench/calibration_table.py [--goniocam build/release/goniocam] [--shots 24] [--keep FOLDER] [KIND...]

Renders samples/tiny.yaml with a few things changed (KINDS below; default all), as many shots as asked (issue 5: 20 to
60), calibrates, and prints against truth.json: the sample's centre, mm; the worst lamp, mm (at infinity: none) and
degrees, seen from the sample; power of the shots, % rms; focal length, %; camera centres, mm, and rotations, degrees,
medians; and of the worst lamp how sure each cue alone is of its direction, degrees, beside the joint answer.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

import numpy as np
import yaml

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(TOP, "tests"))
import round_trip_matrix as M

GGX = M.PLASTIC
SPOT = {"name": "spot", "azimuth_deg": 272, "elevation_deg": 30, "distance": 600, "beam": [0.1, 0.8, -0.5], "beam_exponent": 4}
KINDS = {
    "lambert": {"sample.material": {"model": "lambert", "albedo": [0.5, 0.3, 0.2]}},
    "rough": {"sample.material": dict(GGX, alpha=0.4)},
    "glossy": {"sample.material": dict(GGX, alpha=0.1)},
    "mirror-like": {"sample.material": dict(GGX, alpha=0.03)},
    "lit board": {"bounces": 1},
    "cylinder": {"sample": dict(M.CYLINDER, material=GGX)},
    "mesh": {"sample": dict(M.VASE, material=GGX)},
    "raw mesh": {"sample": dict(M.VASE, material=GGX), "sensor": M.RAW, "files": "dng"},
    "lamp on camera": {"lights": [{"name": "flash", "on_camera": True, "position": [95, -40, 10]}]},
    # Board, sample and lamp turn together before a camera on a tripod: seen from the board, it goes around.
    "turntable": {"turntable": True},
    "lamp at infinity": {"lights": [{"name": "sun", "distant": True, "direction": [0.03, -0.82, 0.57], "intensity": 0.28}]},
    "no flat frame": {"camera.vignetting": [-0.12, 0.02, 0]},
    "beam": {"lights": [SPOT]},
}


def scene_of(changes, shots):
    tiny = yaml.safe_load(open(os.path.join(TOP, "samples/tiny.yaml")))
    changes = dict(changes)
    turntable = changes.pop("turntable", False)
    scene = M.changed(tiny, changes)
    scene.pop("table")
    scene["power_jitter"] = 0.02
    if turntable:
        scene["shots"] = [{"spiral": {"count": shots, "turns": 1, "azimuth_deg": 285, "elevation_deg": [42, 42],
                                      "distance": 640, "target": [0, 0, 25]}}]
    else:
        scene["handheld"] = {"place": 12, "aim_deg": 0.5, "roll_deg": 4}
        scene["shots"][0]["arc"]["count"] = shots - len(scene["shots"]) + 1
    return scene


def rotation(v):
    angle = np.linalg.norm(v)
    x, y, z = np.asarray(v) / max(angle, 1e-300)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def angle_of(a, b):
    a, b = (np.asarray(v) / np.linalg.norm(v) for v in (a, b))
    return np.degrees(np.arcsin(min(np.linalg.norm(np.cross(a, b)), 1)))


def lamps(cal, truth):
    """(mm or nan, degrees, the lamp) of each that was used."""
    for light in cal["lights"]:
        true = next(t for t in truth["lights"] if t["name"] == light["name"])
        center = np.array(truth["sample"]["center"]) if true["frame"] == "world" else np.array([0, 0, 600.0])
        if "position" not in light:
            yield np.nan, angle_of(light["direction"], true.get("direction") or true["position"]), light
            continue
        found, there = np.array(light["position"]), np.array(true["position"])
        yield np.linalg.norm(found - there), angle_of(found - center, there - center), light


def figures(cal, truth, nominal):
    by_name = {os.path.splitext(s["exposures"][0]["file"])[0]: s for s in truth["shots"]}
    eyes, turns, power = [], [], []
    for shot in cal["shots"]:
        t = by_name[os.path.splitext(shot["name"])[0]]
        r = rotation(shot["rotation"])
        eyes.append(np.linalg.norm(-r.T @ shot["translation"] - t["eye"]))
        cosine = (np.trace(r @ np.array(t["R"]).T) - 1) / 2
        turns.append(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
        power.append((shot["power"], t["light_jitter"]))
    found, true = np.array(power).T
    off = np.subtract(cal["sample"]["center"], truth["sample"]["center"])
    if truth["sample"]["kind"] == "mesh":  # of its box's middle, from where the file's own place puts it
        off = np.subtract(cal["sample"]["translation"], nominal["pose"][3:])
    elif "axis" in truth["sample"]:  # along its axis a cylinder is found by its ends only
        axis = np.array(truth["sample"]["axis"]) / np.linalg.norm(truth["sample"]["axis"])
        off = off - axis * (off @ axis)
    mm, degrees, worst = max(lamps(cal, truth), key=lambda row: row[1])
    cues = "  ".join("%s %.3f" % (c["cue"], np.degrees(c["sigma_direction"])) for c in worst.get("cues", []))
    fx = 100 * abs(cal["cameras"][0]["focal"][0] / truth["camera"]["fx"] - 1)
    rms = 100 * np.sqrt(np.mean((found / found.mean() / (true / true.mean()) - 1) ** 2))
    return "%8.4f %8.3f %8.4f %8.4f %9.5f %8.4f %8.5f   %s" % (
        np.linalg.norm(off), mm, degrees, rms, fx, np.median(eyes), np.median(turns), cues)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--goniocam", default=os.path.join(TOP, "build/release/goniocam"))
    parser.add_argument("--shots", type=int, default=24)
    parser.add_argument("--keep")
    parser.add_argument("kinds", nargs="*")
    a = parser.parse_args()
    print("%-18s %8s %8s %8s %8s %9s %8s %8s   %s" % ("", "centre", "lamp mm", "deg", "power %", "fx %", "eye mm", "deg",
                                                      "sigma of each cue alone, deg"))
    for kind in a.kinds or KINDS:
        with tempfile.TemporaryDirectory() as folder:
            folder = os.path.join(a.keep, kind.replace(" ", "-")) if a.keep else folder
            os.makedirs(folder, exist_ok=True)
            capture, out = os.path.join(folder, "capture"), os.path.join(folder, "out")
            path = os.path.join(TOP, "samples/.bench-scene-%d.yaml" % os.getpid())  # beside the files that it names
            try:
                with open(path, "w") as f:
                    json.dump(scene_of(KINDS[kind], a.shots), f)
                subprocess.run([a.goniocam, "render", path, "-o", capture, "--quiet"], check=True, stdout=subprocess.DEVNULL)
            finally:
                os.remove(path)
            done = subprocess.run([a.goniocam, "calibrate", capture, "-o", out, "--quiet"], stdout=subprocess.DEVNULL,
                                  stderr=subprocess.PIPE, text=True)
            if done.returncode:
                print("%-18s %s" % (kind, done.stderr.strip()), flush=True)
                continue
            cal = yaml.load(open(out + "/calibration.yaml"), getattr(yaml, "CSafeLoader", yaml.SafeLoader))
            nominal = yaml.safe_load(open(capture + "/capture.yaml"))["sample"]
            print("%-18s %s" % (kind, figures(cal, json.load(open(capture + "/truth.json")), nominal)), flush=True)
            for line in done.stderr.splitlines():
                print("    " + line[:170])


if __name__ == "__main__":
    main()
