#!/usr/bin/python3
"""From photographs alone to a BRDF: `goniocam init` lays out the board, a person fills in sample and patch, and the
reconstruction is as good as with the printed layout.

    tests/init.py GONIOCAM PROJECT
"""
import json
import os
import subprocess
import sys
import tempfile

import numpy
import yaml

failed = 0


def check(what, good):
    global failed
    failed += not good
    print("%-70s %s" % (what, "ok" if good else "FAILED"))


def run(*command):
    return subprocess.run(command, capture_output=True, text=True)


def rigid(source, target):
    """Rotation and translation that take points to others, by Kabsch's method, and what is left."""
    a, b = source.mean(0), target.mean(0)
    u, _, v = numpy.linalg.svd((source - a).T @ (target - b))
    d = numpy.diag([1, 1, numpy.sign(numpy.linalg.det(v.T @ u.T))])
    r = v.T @ d @ u.T
    t = b - r @ a
    return r, t, numpy.abs(source @ r.T + t - target).max()


def main():
    goniocam, project = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        capture, out = os.path.join(folder, "capture"), os.path.join(folder, "out")
        subprocess.check_call([goniocam, "render", project + "/samples/tiny.yaml", "-o", capture, "--quiet"],
                              stdout=subprocess.DEVNULL)
        path = os.path.join(capture, "capture.yaml")
        printed = yaml.safe_load(open(path))
        os.remove(path)

        told = run(goniocam, "reconstruct", capture, "-o", out, "--quiet")
        check("reconstruct offers init", told.returncode == 1 and "goniocam init" in told.stderr)
        check("no tag size: usage", run(goniocam, "init", capture).returncode == 2)
        told = run(goniocam, "init", capture, "--tag-size", "30", "--json", "--quiet")
        print(told.stderr, end="")
        check("init", told.returncode == 0 and json.loads(told.stdout)["shots"] == 6)
        check("it writes over nothing", run(goniocam, "init", capture, "--tag-size", "30").returncode == 1)

        begun = yaml.safe_load(open(path))
        there = {t["id"]: t["center"] for t in printed["board"]["tags"]}
        found = {t["id"]: t["center"] for t in begun["board"]["tags"]}
        check("all tags but one or two, no others", set(found) <= set(there) and len(found) >= len(there) - 2)
        ids = sorted(found)
        r, t, worst = rigid(numpy.array([there[i] for i in ids], float), numpy.array([found[i] for i in ids], float))
        print("tags off by at most %.4f mm; place_sigma says %.4f" % (worst, begun["board"]["place_sigma"]))
        check("tags within 0.05 mm, and within 4 sigma", worst < 0.05 and worst < 4 * begun["board"]["place_sigma"])
        check("the board's plane is z = 0", max(abs(c[2]) for c in found.values()) < 0.05)

        # What a person with a ruler fills in, in the frame that the file describes.
        move = lambda p: [float(x) for x in r @ numpy.array(p, float) + t]
        sample, patch = dict(printed["sample"]), dict(printed["reference"])
        sample["center"] = move(sample["center"])
        patch["corners"] = [move(c) for c in patch["corners"]]
        with open(path, "a") as f:
            f.write(yaml.safe_dump({"sample": sample, "reference": patch}, default_flow_style=None))
        told = run(goniocam, "reconstruct", capture, "-o", out, "--quiet", "--json")
        print(told.stderr, end="")
        check("reconstruct", told.returncode == 0)
        best = yaml.safe_load(open(os.path.join(out, "fits.yaml")))["models"]
        ggx = [m for m in best if m["name"] == "ggx"][0]["parameters"]
        albedo = numpy.array(ggx["albedo"]["value"]) / numpy.array([0.12, 0.24, 0.33]) - 1
        print("albedo off by", numpy.round(100 * albedo, 2), "%, alpha", ggx["alpha"]["value"])
        check("albedo to 1 %", numpy.abs(albedo).max() < 0.01)
        check("alpha to 1 %", abs(ggx["alpha"]["value"] / 0.2 - 1) < 0.01)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
