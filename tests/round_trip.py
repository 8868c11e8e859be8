#!/usr/bin/python3
"""A synthetic round trip: render photographs of known truth, reconstruct them, compare.

    tests/round_trip.py GONIOCAM PROJECT

The scene is samples/tiny.yaml. Limits are three times what its noise and size (few, small photographs) leave, or
looser; the figures of full captures are tests/bench/accuracy.py's.
"""
import filecmp
import json
import os
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import truth as T

failed = 0


def check(what, value, limit):
    global failed
    good = value <= limit
    failed += not good
    print("%-44s %10.4g  (limit %g)%s" % (what, value, limit, "" if good else "  FAILED"))


def geometry(cal, truth):
    cam, true = cal["cameras"][0], truth.t["camera"]
    check("focal length, %", 100 * max(abs(cam["focal"][0] / true["fx"] - 1), abs(cam["focal"][1] / true["fy"] - 1)), 0.1)
    check("sphere centre, mm", np.linalg.norm(np.subtract(cal["sample"]["center"], truth.t["sample"]["center"])), 0.05)
    for k, light in enumerate(cal["lights"]):
        check("lamp %d, mm" % k, np.linalg.norm(np.subtract(light["position"], truth.t["lights"][k]["position"])), 5)
    power = np.array([s["power"] for s in cal["shots"]])
    true_power = np.array([s["light_jitter"] for s in truth.t["shots"]])
    lamp = np.array([s["light"] for s in truth.t["shots"]])
    for k in set(lamp):
        true_power[lamp == k] /= true_power[lamp == k].mean()
    check("power of the shots, max %", 100 * np.abs(power / true_power - 1).max(), 0.5)


def reflectance(out, truth):
    error, z = truth.bins(out)
    check("measured bins to 75 deg, median %", 100 * np.median(np.abs(error)), 1)
    check("measured bins to 75 deg, 95 %", 100 * np.quantile(np.abs(error), 0.95), 5)
    check("bins beyond 2 sigma, %", 100 * (np.abs(z) > 2).mean(), 15)
    check("no bins measured", len(error) < 5000, 0)
    fits = {m["name"]: m["parameters"] for m in T.load(out + "/fits.yaml")["models"]}
    material, ggx = truth.material, fits["ggx"]
    check("ggx albedo, %", 100 * np.abs(np.divide(ggx["albedo"]["value"], material["albedo"]) - 1).max(), 1)
    check("ggx alpha, %", 100 * abs(ggx["alpha"]["value"] / material["alpha"] - 1), 2)
    check("ggx ior", abs(ggx["ior"]["value"] - material["ior"]), 0.02)


def albedos(out, truth):
    """Of the complete table: measured where the twelve photographs reach, filled elsewhere."""
    for at in json.load(open(out + "/run.json"))["checks"]["directional_albedo"]:
        if at["theta_i_deg"] <= 75:
            true = T.albedo(truth.material, at["theta_i_deg"])
            check("albedo at %g deg, sigmas off" % at["theta_i_deg"],
                  (np.abs(np.subtract(at["albedo"], true)) / at["sigma"]).max(), 3)
            check("its sigma, %", 100 * (at["sigma"] / true).max(), 5)


def main():
    goniocam, project = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        capture, one, two = (os.path.join(folder, n) for n in ("capture", "one", "two"))
        run = lambda *a: subprocess.check_call([goniocam, *a, "--quiet"], stdout=subprocess.DEVNULL)
        run("render", os.path.join(project, "samples/tiny.yaml"), "-o", capture)
        run("reconstruct", capture, "-o", one, "--threads", "1")
        run("reconstruct", capture, "-o", two, "--threads", "2")
        truth = T.Truth(os.path.join(capture, "truth.json"))
        geometry(T.load(os.path.join(one, "calibration.yaml")), truth)
        reflectance(one, truth)
        albedos(one, truth)
        for name in ("brdf.binary", "calibration.yaml", "fits.yaml"):
            check("%s differs between 1 and 2 threads" % name,
                  not filecmp.cmp(os.path.join(one, name), os.path.join(two, name), shallow=False), 0)
        run("reconstruct", capture, "-o", two, "--threads", "2")  # again, from what is there
        check("brdf.binary differs when run again",
              not filecmp.cmp(os.path.join(one, "brdf.binary"), os.path.join(two, "brdf.binary"), shallow=False), 0)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
