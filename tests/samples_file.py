#!/usr/bin/python3
"""samples.h5, read by h5py without our help: all used photosites, and each the BRDF of what was rendered.

    tests/samples_file.py GONIOCAM PROJECT
"""
import json
import os
import shutil
import subprocess
import sys
import tempfile

import h5py
import numpy as np
import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import truth as T

failed = 0


def check(what, value, limit):
    global failed
    failed += not value <= limit
    print("%-52s %10.4g  (limit %g)%s" % (what, value, limit, "" if value <= limit else "  FAILED"))


def local(v, n):
    """World directions in a frame whose z is the normal."""
    x = np.cross(n, np.where(np.abs(n[:, :1]) < 0.7, [[1, 0, 0]], [[0, 1, 0]]))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([(v * a).sum(1) for a in (x, np.cross(n, x), n)], 1)


def ggx(goniocam, source, fits):
    """Parameters and sigmas of model ggx, fitted to a file."""
    subprocess.check_call([goniocam, "fit", source, "--model", "ggx", "-o", fits, "--quiet"], stdout=subprocess.DEVNULL)
    with open(fits) as f:
        model = yaml.safe_load(f)["models"][0]["parameters"]
    flat = lambda key: np.hstack([model[p][key] for p in ("albedo", "alpha", "ior")])
    return flat("value"), flat("sigma")


def fits(goniocam, at):
    """What is fitted to all samples, to bins.h5 and to OUT."""
    with open(at("capture/truth.json")) as f:
        m = json.load(f)["sample"]["material"]
    due = np.hstack([m["albedo"], m["alpha"], m["ior"]])
    bins, _ = ggx(goniocam, at("1/bins.h5"), at("bins.yaml"))
    folder, _ = ggx(goniocam, at("1"), at("folder.yaml"))
    samples, sigma = ggx(goniocam, at("1/samples.h5"), at("samples.yaml"))
    check("fit to bins.h5 is that to OUT", np.abs(bins - folder).max(), 0)
    check("fit to samples.h5 beyond 3 of its sigmas", (np.abs(samples - due) / sigma).max(), 3)
    check("fit to samples.h5, %", 100 * np.abs(samples / due - 1).max(), 1)
    shutil.copy(at("1/samples.h5"), at("bad.h5"))
    with h5py.File(at("bad.h5"), "a") as f:
        del f[list(f)[0]]["weight"]
    bad = subprocess.run([goniocam, "fit", at("bad.h5"), "-o", at("bad.yaml")], capture_output=True, text=True)
    check("a dataset is missing: exit 1, named, nothing written",
          not (bad.returncode == 1 and "bad.h5" in bad.stderr and not os.path.exists(at("bad.yaml"))), 0)


def main():
    goniocam, project = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        at = lambda name: os.path.join(folder, name)
        run = lambda *a: subprocess.check_call([goniocam, *a, "--quiet"], stdout=subprocess.DEVNULL)
        run("render", os.path.join(project, "samples/tiny.yaml"), "-o", at("capture"))
        for n in ("1", "2"):
            run("reconstruct", at("capture"), "-o", at(n), "--samples", "--threads", n)
        fits(goniocam, at)
        truth = T.Truth(at("capture/truth.json"))
        with h5py.File(at("1/samples.h5")) as f, h5py.File(at("2/samples.h5")) as g:
            differ = sum(f[s][k][...].tobytes() != g[s][k][...].tobytes() for s in f for k in f[s])
            check("datasets that differ between 1 and 2 threads", differ, 0)
            check("shots without samples", len(truth.t["shots"]) - len(f), 0)
            s = {k: np.concatenate([f[shot][k][...].astype(float) for shot in f]) for k in f[list(f)[0]]}
        with open(at("1/run.json")) as f:
            used = json.load(f)["photosites"]["used"]
        check("used photosites that are not in the file", abs(used - len(s["f"])), 0)
        with h5py.File(at("1/bins.h5")) as f:
            check("samples that are in no bin", abs(int(f["count"][...].sum()) - len(s["f"])), 0)
        for k in ("normal", "wi", "wo"):
            check("%s is not unit" % k, np.abs(np.linalg.norm(s[k], axis=1) - 1).max(), 1e-6)
        centre, radius = np.array(truth.t["sample"]["center"]), truth.t["sample"]["radius"]
        away = np.linalg.norm(s["point"] - centre, axis=1) - radius
        check("points off the ball, mm", np.abs(away).max(), 0.05)
        wi, wo = local(s["wi"], s["normal"]), local(s["wo"], s["normal"])
        good = np.minimum(wi[:, 2], wo[:, 2]) > np.cos(np.radians(75))
        due = T.ggx(truth.material, wi[good], wo[good])
        error = s["f"][good] / due - 1
        z = (s["f"][good] - due) / np.sqrt(s["variance"][good] + (due * s["systematic"][good, None]) ** 2)
        check("f to 75 deg, median %", 100 * np.median(np.abs(error)), 1)
        check("f beyond 2 sigma (steep highlights have tilt besides), %", 100 * (np.abs(z) > 2).mean(), 12)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
