#!/usr/bin/python3
"""The same bits however the work is done: threads, a run that was killed, photographs in another order.

    tests/identical.py GONIOCAM PROJECT

The scene is samples/tiny.yaml. Photographs are renamed so that shots come in another order.
"""
import os
import random
import subprocess
import sys
import tempfile
import time

import h5py
import yaml

failed = 0


def check(what, good):
    global failed
    failed += not good
    print("%-60s %s" % (what, "ok" if good else "FAILED"))


def same(a, b, what):
    """brdf.binary to the byte, bins.h5 in all its datasets."""
    good = open(a + "/brdf.binary", "rb").read() == open(b + "/brdf.binary", "rb").read()
    with h5py.File(a + "/bins.h5") as f, h5py.File(b + "/bins.h5") as g:
        good = good and set(f) == set(g) and all(f[k][...].tobytes() == g[k][...].tobytes() for k in f)
    check(what, good)


def killed_and_resumed(goniocam, capture, out, files):
    """Kill a run when these files are complete in its folder OUT; then let one finish. -> did it die of that?"""
    command = [goniocam, "reconstruct", capture, "-o", out, "--quiet", "--threads", "2"]
    p = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    complete = lambda: sum(os.path.exists(os.path.join(out, name)) for name in files)
    while complete() < len(files) and p.poll() is None:
        time.sleep(0.001)
    p.kill()
    died = p.wait() != 0
    for name in ("brdf.binary", "bins.h5", "calibration.yaml"):  # under their names only when complete
        path = os.path.join(out, name)
        if name == "bins.h5" and os.path.exists(path):
            h5py.File(path).close()
    subprocess.check_call(command, stdout=subprocess.DEVNULL)
    return died


def renamed(capture, to):
    """The same photographs under names that put the shots in another order; -> old name: new name of shots."""
    os.mkdir(to)
    shots = sorted({n.split("_exp")[0] for n in os.listdir(capture) if "_exp" in n})
    order = random.Random(3).sample(shots, len(shots))
    new = dict(zip(shots, order))
    for name in os.listdir(capture):
        shot = name.split("_exp")[0]
        target = name.replace(shot, new[shot], 1) if "_exp" in name else name
        os.symlink(os.path.join(capture, name), os.path.join(to, target))
    return new


def renamed_calibration(path, to, new):
    with open(path) as f:
        cal = yaml.safe_load(f)
    for shot in cal["shots"]:
        old = shot["name"].split("_exp")[0]
        shot["name"] = shot["name"].replace(old, new[old], 1)
    cal["shots"].sort(key=lambda s: s["name"])
    with open(to, "w") as f:
        yaml.safe_dump(cal, f)


def main():
    goniocam, project = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        at = lambda name: os.path.join(folder, name)
        run = lambda *a: subprocess.check_call([goniocam, *a, "--quiet"], stdout=subprocess.DEVNULL)
        run("render", os.path.join(project, "samples/tiny.yaml"), "-o", at("capture"))
        run("reconstruct", at("capture"), "-o", at("t1"), "--threads", "1")
        for n in ("2", "4"):
            run("reconstruct", at("capture"), "-o", at("t" + n), "--threads", n)
            same(at("t1"), at("t" + n), "%s threads" % n)
        maps = sorted(os.path.join("radiance", n) for n in os.listdir(at("t1/radiance")) if n.endswith(".exr"))
        for k, (when, files) in enumerate({"the second map": maps[:2], "the calibration": ["calibration.yaml"]}.items()):
            died = killed_and_resumed(goniocam, at("capture"), at("k%d" % k), files)
            check("killed once %s was there" % when, died)
            same(at("t1"), at("k%d" % k), "and run again")

        with open(os.path.join(project, "samples/tiny.yaml")) as f:
            lit = dict(yaml.safe_load(f), bounces=1)
        with open(at("lit.yaml"), "w") as f:
            yaml.safe_dump(lit, f)
        run("render", at("lit.yaml"), "-o", at("lit"))
        for n in ("1", "2"):
            run("reconstruct", at("lit"), "-o", at("lit" + n), "--threads", n)
        same(at("lit1"), at("lit2"), "2 threads, over a lit board")

        cal = at("t1/calibration.yaml")
        run("reconstruct", at("capture"), "-o", at("given"), "--calibration", cal)
        renamed_calibration(cal, at("other.yaml"), renamed(at("capture"), at("shuffled")))
        run("reconstruct", at("shuffled"), "-o", at("other"), "--calibration", at("other.yaml"))
        same(at("given"), at("other"), "photographs under other names, calibration given")
        run("reconstruct", at("shuffled"), "-o", at("anew"), "--threads", "1")
        same(at("t1"), at("anew"), "the same, calibrated anew")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
