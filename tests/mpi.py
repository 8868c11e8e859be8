#!/usr/bin/python3
"""goniocam-mpi with real ranks on this machine: the same bytes as one process, and what happens when something fails.

    tests/mpi.py GONIOCAM PROJECT        goniocam-mpi is looked for beside GONIOCAM; skipped (77) without mpirun
"""
import filecmp
import glob
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import h5py

failed = 0
MPIRUN = ["mpirun", "--allow-run-as-root", "--oversubscribe", "-n"]


def check(what, good):
    global failed
    failed += not good
    print("%-60s %s" % (what, "ok" if good else "FAILED"))


def same(a, b):
    return all(filecmp.cmp(os.path.join(a, n), os.path.join(b, n), shallow=False)
               for n in ("brdf.binary", "bins.h5", "calibration.yaml", "fits.yaml"))


def descendants(pid):
    """Processes below a process, by /proc."""
    parents = {}
    for name in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open("/proc/%s/stat" % name) as f:
                parents[int(name)] = int(f.read().rsplit(")", 1)[1].split()[1])
        except (OSError, IndexError):
            pass
    below, new = set(), {pid}
    while new:
        new = {p for p, parent in parents.items() if parent in new} - below
        below |= new
    return sorted(below)


def lose_one_rank(command, out):
    """Kill the last process of a job when its first radiance map stands in `out`; -> exit status, what it said."""
    p = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    while p.poll() is None and not glob.glob(os.path.join(out, "radiance", "*.exr")):
        time.sleep(0.01)
    ranks = [q for q in descendants(p.pid) if "goniocam-mpi" in os.path.realpath("/proc/%d/exe" % q)]
    if ranks:
        os.kill(ranks[-1], signal.SIGKILL)
    try:
        story = p.communicate(timeout=60)[1].decode()
    except subprocess.TimeoutExpired:
        p.kill()
        story = "hangs"
    return p.returncode, story


def samples(path):
    """Everything in a samples.h5, as text that compares."""
    with h5py.File(path) as f:
        return {"%s/%s" % (shot, k): f[shot][k][...].tobytes() for shot in f for k in f[shot]}


def main():
    goniocam, project = sys.argv[1:3]
    mpi = os.path.join(os.path.dirname(goniocam), "goniocam-mpi")
    if not shutil.which("mpirun") or not os.path.exists(mpi):
        print("no mpirun or no goniocam-mpi: skipped")
        sys.exit(77)
    quiet = dict(stdout=subprocess.DEVNULL)
    with tempfile.TemporaryDirectory() as folder:
        at = lambda name: os.path.join(folder, name)
        subprocess.check_call([goniocam, "render", project + "/samples/tiny.yaml", "-o", at("capture"), "--quiet"], **quiet)
        subprocess.check_call([goniocam, "reconstruct", at("capture"), "-o", at("one"), "--quiet"], **quiet)
        for n in ("1", "2", "3"):
            subprocess.check_call(MPIRUN + [n, mpi, "reconstruct", at("capture"), "-o", at("m" + n), "--quiet"], **quiet)
            check("%s ranks: the same bytes as one process" % n, same(at("one"), at("m" + n)))
        for command, out in (([goniocam], "s1"), (MPIRUN + ["2", mpi], "s2")):
            subprocess.check_call(command + ["reconstruct", at("capture"), "-o", at(out), "--quiet", "--samples"], **quiet)
        check("2 ranks: the same samples", samples(at("s1/samples.h5")) == samples(at("s2/samples.h5")))
        check("no parts of samples.h5 are left", not [n for n in os.listdir(at("s2")) if "part" in n])

        job = MPIRUN + ["2", mpi, "reconstruct", at("capture"), "-o", at("lost"), "--quiet"]
        code, story = lose_one_rank(job, at("lost"))
        check("a lost rank ends the job with a message", code != 0 and "signal 9" in story)
        check("nothing half-written", not os.path.exists(at("lost/brdf.binary")))
        subprocess.check_call(job, **quiet)
        check("run again: the same bytes", same(at("one"), at("lost")))

        shutil.copytree(at("capture"), at("torn"))
        photo = sorted(n for n in os.listdir(at("torn")) if n.endswith(".tif") and "exp" in n)[4]
        os.truncate(os.path.join(at("torn"), photo), 1000)
        told = []
        for command, out in (([goniocam], "t1"), (MPIRUN + ["2", mpi], "t2")):
            run = subprocess.run(command + ["reconstruct", at("torn"), "-o", at(out), "--quiet"],
                                 stderr=subprocess.PIPE, **quiet)
            told.append([line for line in run.stderr.decode().splitlines() if photo in line])
            check("%s: a torn photograph is left out, and named once" % out, run.returncode == 0 and len(told[-1]) == 1)
        check("2 ranks: the same bytes without it", same(at("t1"), at("t2")))
        warnings = [sorted(json.load(open(at(out + "/run.json")))["warnings"]) for out in ("t1", "t2")]
        check("2 ranks: the same warnings in run.json", warnings[0] == warnings[1] and len(warnings[0]) > 0)

        run = subprocess.run(MPIRUN + ["2", mpi, "reconstruct", at("nowhere"), "-o", at("x"), "--quiet"],
                             stderr=subprocess.PIPE, **quiet)
        said = [line for line in run.stderr.decode().splitlines() if line.startswith("goniocam")]
        check("what fails everywhere is told once", run.returncode == 1 and len(said) == 1 and "nowhere" in said[0])
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
