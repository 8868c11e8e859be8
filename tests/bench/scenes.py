#!/usr/bin/python3
"""How well materials come back from captures of many kinds: every scene of samples/, and the round-trip matrix.

    tests/bench/scenes.py [--goniocam build/release/goniocam] [--keep FOLDER] [NAME...]

Renders each scene, reconstructs it, and compares the measured bins with the scene's material at their centroids: by the
larger of theta_i and theta_o, the median and 95 % of the relative error and its signed median, in per cent; the share
within 1 and 2 standard errors (0.68 and 0.95 wanted); how many bins were measured; the sample's centre, mm, and the
worst lamp, % of its distance. NAME: files of samples/ without ending, rows of tests/round_trip_matrix.py, or
of MORE below; default all. --keep: leave CAPTURE and OUT there.
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


GGX = M.PLASTIC
FLASH = {"lights": [{"name": "flash", "on_camera": True, "position": [95, -40, 10]}]}
# A sensor of a hundredth of the usual noise's variance, and four times the photosites: what is left is systematic.
QUIET = {"sensor": {"electrons": 5e9, "full_well": 1e7, "dn_per_electron": 0.006, "adc_max": 65000, "read_noise": 20,
                    "black_level": 512}}
FINE = dict(QUIET, **{"camera.size": [1280, 860], "camera.center_px": [644.2, 425.2]})
# More kinds than the tests have time for, as changes of samples/tiny.yaml: what no fit's family holds, what is dark, what
# mirrors, lamps that are large, near or many, other sensors and files.
MORE = {
    "mirror-like": {"sample.material": dict(GGX, alpha=0.03)},
    "mirror-like, lit board": {"sample.material": dict(GGX, alpha=0.03), "bounces": 1},
    "glossy, lit board": {"sample.material": dict(GGX, alpha=0.08), "bounces": 1},
    "glossy, lit board, twice": {"sample.material": dict(GGX, alpha=0.08), "bounces": 2},
    "black": {"sample.material": dict(GGX, albedo=[0.01, 0.008, 0.012])},
    "black, lit board": {"sample.material": dict(GGX, albedo=[0.01, 0.008, 0.012]), "bounces": 1},
    "white, lit board": {"sample.material": {"model": "lambert", "albedo": [0.9, 0.85, 0.8]}, "bounces": 1},
    "white, lit board, twice": {"sample.material": {"model": "lambert", "albedo": [0.9, 0.85, 0.8]}, "bounces": 2},
    "polished metal": {"sample.material": {"model": "ggx_conductor", "eta": [0.2, 0.92, 1.1], "k": [3.9, 2.45, 2.2],
                                           "alpha": 0.1}},
    "metal, lit board": {"sample.material": {"model": "ggx_conductor", "eta": [0.2, 0.92, 1.1], "k": [3.9, 2.45, 2.2],
                                             "alpha": 0.2}, "bounces": 1},
    "metal, lit board, twice": {"sample.material": dict(M.METAL, alpha=0.2), "bounces": 2},
    "two lobes": {"sample.material": [dict(GGX, alpha=0.08, scale=0.5), dict(GGX, alpha=0.4)]},
    "velvet": {"sample.material": {"model": "disney", "base": [0.2, 0.05, 0.1], "metallic": 0, "roughness": 0.8, "specular": 0.2,
                                   "specular_tint": 0, "sheen": 1, "sheen_tint": 0.5, "subsurface": 0.6, "clearcoat": 0,
                                   "clearcoat_gloss": 0}},
    "lacquer": {"sample.material": {"model": "disney", "base": [0.3, 0.05, 0.02], "metallic": 0.3, "roughness": 0.5,
                                    "specular": 0.5, "specular_tint": 0, "sheen": 0, "sheen_tint": 0, "subsurface": 0,
                                    "clearcoat": 1, "clearcoat_gloss": 0.6}},
    "retro-reflector": {"sample.material": {"model": "lafortune", "albedo": [0.2, 0.2, 0.1], "cxy": [0.6, 0.6, 0.6],
                                            "cz": [0.6, 0.6, 0.6], "n": [8, 8, 8]}},
    "phong": {"sample.material": {"model": "blinn_phong", "kd": [0.05, 0.08, 0.1], "ks": [0.3, 0.3, 0.3], "ke": [60, 60, 60]}},
    "sgd": {"sample.material": {"model": "sgd", "rhoD": [0.05, 0.1, 0.2], "rhoS": [0.15, 0.15, 0.15],
                                "alpha": [0.02, 0.02, 0.02], "p": [0.7, 0.7, 0.7], "F0": [0.1, 0.1, 0.1], "F1": [0, 0, 0],
                                "lambda": [1, 1, 1], "c": [1, 1, 1], "k": [6, 6, 6], "theta0": [0.6, 0.6, 0.6]}},
    "large bulb": {"lights": [{"name": "bulb", "azimuth_deg": 272, "elevation_deg": 30, "distance": 600, "radius": 20}]},
    "glossy, large bulb": {"sample.material": dict(GGX, alpha=0.08), "lights": [
        {"name": "bulb", "azimuth_deg": 272, "elevation_deg": 30, "distance": 600, "radius": 20}]},
    "near lamp": {"lights": [{"name": "lamp", "azimuth_deg": 272, "elevation_deg": 40, "distance": 250, "intensity": 2e4}]},
    "distant lamp": {"lights": [{"name": "sun", "distant": True, "direction": [0.03, -0.82, 0.57], "intensity": 0.28}]},
    "wide beam, matt": {"lights": [{"name": "spot", "azimuth_deg": 272, "elevation_deg": 30, "distance": 600,
                                    "beam": [0, 0.85, -0.5], "beam_exponent": 1.5}],
                        "sample.material": {"model": "lambert", "albedo": [0.5, 0.3, 0.2]}},
    "beam, lit board": {"lights": [{"name": "spot", "azimuth_deg": 272, "elevation_deg": 30, "distance": 600,
                                    "beam": [0, 0.85, -0.5], "beam_exponent": 4}], "bounces": 1},
    "two patches": {"patch": [{"center": [56, 2], "size": 32}, {"center": [-58, 6], "size": 26, "albedo": 0.5}]},
    "raw, lit board": {"sensor": M.RAW, "files": "dng", "bounces": 1},
    "raw, glossy": {"sensor": M.RAW, "files": "dng", "sample.material": dict(GGX, alpha=0.08)},
    "jpeg, lit board": {"files": "jpeg", "bounces": 1},
    "jpeg, glossy": {"files": "jpeg", "sample.material": dict(GGX, alpha=0.08)},
    "blur": {"camera.blur_px": 0.8},
    "glossy cylinder": {"sample": dict(M.CYLINDER, material=dict(GGX, alpha=0.1))},
    "cylinder, flash": dict(FLASH, sample=dict(M.CYLINDER, material=GGX)),
    "glossy mesh": {"sample": dict(M.VASE, material=dict(GGX, alpha=0.1))},
    "small ball": {"sample.radius": 12, "sample.center": [-0.5, 0.4, 31.8], "sample.nominal_center": [0, 0, 32]},
    "power jitter": {"power_jitter": 0.02},
    "uneven pixels": {"sensor": {"prnu": 0.01, "hot_fraction": 0.001}},
    "glare": {"camera.glare": 0.003},
    "quiet": QUIET,
    "fine": FINE,
    "fine, glossy": dict(FINE, **{"sample.material": dict(GGX, alpha=0.08)}),
    "fine, matt": dict(FINE, **{"sample.material": {"model": "lambert", "albedo": [0.5, 0.3, 0.2]}}),
    "fine, lit board": dict(FINE, bounces=1),
    "room light": {"ambient": 2e-4},
}


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
    for name, changes in [(n, row[0]) for n, row in M.MATRIX.items()] + list(MORE.items()):
        yield name, M.changed(tiny, changes)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--goniocam", default=os.path.join(TOP, "build/release/goniocam"))
    parser.add_argument("--keep")
    parser.add_argument("names", nargs="*")
    a = parser.parse_args()
    print("%-28s %s   bins    mm  lamp %%   s" % ("", "".join("  to %d deg: median 95 %% signed z " % b[1] for b in BANDS)))
    for name, scene in scenes():
        if a.names and name not in a.names:
            continue
        print("%-28s " % name, end="", flush=True)
        with tempfile.TemporaryDirectory() as folder:
            if a.keep:
                folder = os.path.join(a.keep, name.replace(" ", "-").replace(",", ""))
                os.makedirs(folder, exist_ok=True)
            trip(a.goniocam, scene, os.path.join(TOP, "samples"), folder)


if __name__ == "__main__":
    main()
