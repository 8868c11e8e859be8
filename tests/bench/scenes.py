#!/usr/bin/python3
"""How well materials come back from captures of many kinds: every scene of samples/, and the round-trip matrix.

    tests/bench/scenes.py [--goniocam build/release/goniocam] [--keep FOLDER] [NAME...]

Renders each scene, reconstructs it, and compares the measured bins with the scene's material at their centroids: by the
larger of theta_i and theta_o, the median and 95 % of the relative error and its signed median, in per cent; the share
within 1 and 2 standard errors (0.68 and 0.95 wanted); how many bins were measured; the sample's centre, mm, and the
worst lamp, % of its distance. NAME: files of samples/ without ending, or rows of tests/round_trip_matrix.py; default
all. --keep: leave CAPTURE and OUT there.
"""
import argparse
import glob
import json
import os
import subprocess
import sys
import tempfile
import time

import h5py
import numpy as np
import yaml

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(TOP, "tests"))
import round_trip_matrix as M
import truth as T

BANDS = ((0, 60), (60, 75), (75, 85))


def model_file(material, path):
    parameters = {k: {"value": v, "sigma": 0 if not isinstance(v, list) else [0] * len(v)}
                  for k, v in material.items() if k not in ("model", "scale")}
    with open(path, "w") as f:
        yaml.safe_dump({"models": [{"name": material["model"], "parameters": parameters}]}, f)


def evaluate(goniocam, material, wi, wo, folder):
    """f [n][3] of a scene's material: a model or a list of them."""
    parts = material if isinstance(material, list) else [material]
    phi = np.arctan2(wo[:, 1], wo[:, 0]) - np.arctan2(wi[:, 1], wi[:, 0])
    rows = np.degrees(np.stack([np.arccos(wi[:, 2]), np.arccos(wo[:, 2]), phi], -1))
    text = "\n".join("%.17g %.17g %.17g" % tuple(row) for row in rows) + "\n"
    total = 0
    for part in parts:
        path = os.path.join(folder, "model.yaml")
        model_file(part, path)
        out = subprocess.run([goniocam, "eval", path], input=text, text=True, stdout=subprocess.PIPE, check=True).stdout
        total = total + part.get("scale", 1) * np.fromstring(out, sep=" ").reshape(-1, 3)
    return total


def measured(out):
    with h5py.File(os.path.join(out, "bins.h5")) as f:
        seen = f["status"][...] == 1
        return [f[k][...][seen] for k in ("mean", "stderr", "centroid")]


def geometry(capture, out):
    truth = json.load(open(os.path.join(capture, "truth.json")))
    cal = yaml.load(open(os.path.join(out, "calibration.yaml")), getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    off = np.subtract(cal["sample"]["center"], truth["sample"]["center"])
    if "axis" in truth["sample"]:  # along its axis a cylinder is found by its ends only
        axis = np.array(truth["sample"]["axis"]) / np.linalg.norm(truth["sample"]["axis"])
        off = off - axis * (off @ axis)
    lamps = M.lamp_error(cal, truth) if all("position" in l for l in cal["lights"]) else float("nan")
    return np.linalg.norm(off), lamps


def trip(goniocam, scene, files, folder):
    capture, out = (os.path.join(folder, n) for n in ("capture", "out"))
    path = os.path.join(files, ".bench-scene-%d.yaml" % os.getpid())  # beside the files that it names
    try:
        with open(path, "w") as f:
            json.dump(scene, f)
        subprocess.run([goniocam, "render", path, "-o", capture, "--quiet"], check=True, stdout=subprocess.DEVNULL)
    finally:
        os.remove(path)
    begin = time.monotonic()
    done = subprocess.run([goniocam, "reconstruct", capture, "-o", out, "--quiet"], stdout=subprocess.DEVNULL,
                          stderr=subprocess.PIPE, text=True)
    seconds = time.monotonic() - begin
    for line in done.stderr.splitlines():
        if done.returncode or "warning" in line:
            print("    " + line[:200])
    if done.returncode:
        return
    mean, stderr, angles = measured(out)
    wi, wo = T.directions(angles)
    above = np.minimum(wi[:, 2], wo[:, 2]) > 1e-3
    mean, stderr, wi, wo = mean[above], stderr[above], wi[above], wo[above]
    f = evaluate(goniocam, scene["sample"]["material"], wi, wo, folder)
    lowest = np.degrees(np.arccos(np.minimum(wi[:, 2], wo[:, 2])))
    text = []
    for low, high in BANDS:
        band = (lowest >= low) & (lowest < high)
        if band.sum() < 30:
            text.append("%31s" % "-")
            continue
        bright = f[band] > 1e-3 / np.pi  # below 0.1 % reflectance a relative error says nothing
        e, z = (mean[band] / f[band] - 1)[bright], np.abs((mean[band] - f[band]) / stderr[band])[bright]
        text.append("%5.2f %5.1f %+6.2f %.2f/%.2f" % (100 * np.median(np.abs(e)), 100 * np.quantile(np.abs(e), 0.95),
                                                     100 * np.median(e), (z < 1).mean(), (z < 2).mean()))
    print("%s %7d %7.3f %6.2f %5.1f" % ("  ".join(text), len(mean), *geometry(capture, out), seconds), flush=True)


def scenes():
    for path in sorted(glob.glob(os.path.join(TOP, "samples/*.yaml"))):
        yield os.path.basename(path)[:-5], yaml.safe_load(open(path))
    tiny = yaml.safe_load(open(os.path.join(TOP, "samples/tiny.yaml")))
    for name, (changes, *_) in M.MATRIX.items():
        yield name, M.changed(tiny, changes)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--goniocam", default=os.path.join(TOP, "build/release/goniocam"))
    parser.add_argument("--keep")
    parser.add_argument("names", nargs="*")
    a = parser.parse_args()
    print("%-22s %s   bins    mm  lamp %%   s" % ("", "".join("  to %d deg: median 95 %% signed z " % b[1] for b in BANDS)))
    for name, scene in scenes():
        if a.names and name not in a.names:
            continue
        print("%-22s " % name, end="", flush=True)
        with tempfile.TemporaryDirectory() as folder:
            if a.keep:
                folder = os.path.join(a.keep, name.replace(" ", "-").replace(",", ""))
                os.makedirs(folder, exist_ok=True)
            trip(a.goniocam, scene, os.path.join(TOP, "samples"), folder)


if __name__ == "__main__":
    main()
