#!/usr/bin/python3
"""Time and memory of a whole `goniocam reconstruct` on captures of 24-megapixel photographs.

    pipeline_scale.py [--build build/release] [--work /tmp/pipeline_scale] [--shots 6,12] [--threads 2] [--size 6000x4000]
                      [--ranks 2] [--memory 10,40]

Renders the six shots of samples/tiny.yaml at 6000 x 4000, five exposures of 4^k/1024 s each, as deflate TIFF (kept in
--work, 1.5 GB and some minutes); more shots than six are links to them under other names. Prints
  - seconds of decoding the files alone (bench_decode) and of `goniocam reconstruct` on the same threads, and their
    ratio, of the wall's clock and of the processors' (asked of 30 shots: at most 2.0); where the seconds went, by
    stages (in brackets: seconds of the processors); with two numbers of shots also the ratio of what each further shot
    costs, and what follows for 30
  - with --ranks N: seconds of `mpirun -n N goniocam-mpi reconstruct --threads 1` beside those of one process on one
    thread (asked of 2 on two cores: 1.7 times as fast)
  - with --memory A,B: the peak memory of A and B shots (asked: at most 3 GiB and the same for 10 and 300), at --small
    a size, since it is the number that matters here
"""
import argparse
import json
import os
import shutil
import subprocess
import time

import yaml

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
EXPOSURES = [4.0 ** k / 1024 for k in range(5)]
TINY = (640, 430)


def size_of(text):
    w, h = text.split("x")
    return int(w), int(h)


def scene(size):
    """samples/tiny.yaml, larger."""
    with open(os.path.join(TOP, "samples/tiny.yaml")) as f:
        s = yaml.safe_load(f)
    s["camera"]["center_px"] = [(c + 0.5) * n / t - 0.5 for c, n, t in zip(s["camera"]["center_px"], size, TINY)]
    if size == (6000, 4000):
        s["camera"]["center_px"] = [3020.1, 1977.6]
    s["camera"]["size"] = list(size)
    s["exposures"] = EXPOSURES
    return s


def make(goniocam, work, size, shots):
    """A capture of so many shots; -> its folder and its photographs."""
    base = os.path.join(work, "capture_%dx%d" % size)
    if not os.path.exists(os.path.join(base, "truth.json")):
        os.makedirs(work, exist_ok=True)
        path = os.path.join(work, "scene.yaml")
        with open(path, "w") as f:
            yaml.safe_dump(scene(size), f)
        subprocess.check_call([goniocam, "render", path, "-o", base, "--quiet"], stdout=subprocess.DEVNULL)
    names = sorted(n for n in os.listdir(base) if n.endswith(".tif") and "flat" not in n)
    folder = os.path.join(work, "shots_%dx%d_%d" % (*size, shots))
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    for n in os.listdir(base):
        if n not in names and os.path.isfile(os.path.join(base, n)):
            os.link(os.path.join(base, n), os.path.join(folder, n))
    each = len(EXPOSURES)
    photos = []
    for s in range(shots):
        for n in names[each * (s % 6):each * (s % 6 + 1)]:
            photos.append(os.path.join(folder, n.replace("_exp", "_r%03d_exp" % (s // 6))))
            os.link(os.path.join(base, n), photos[-1])
    return folder, photos


def run(command):
    """Seconds, seconds of the processors (of all children), megabytes at the peak of the largest process."""
    begin = time.monotonic()
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    story = child.stderr.read()
    _, code, used = os.wait4(child.pid, 0)
    if code:
        raise SystemExit("failed: %s\n%s" % (" ".join(command), story.decode()))
    return time.monotonic() - begin, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def reconstruct(before, work, folder, *more):
    out = os.path.join(work, "out")
    shutil.rmtree(out, ignore_errors=True)
    result = run(before + ["reconstruct", folder, "-o", out, "--quiet", *more])
    with open(os.path.join(out, "run.json")) as f:
        stages = json.load(f)["stages"]
    shutil.rmtree(out)
    return result, stages


def measure(a, goniocam, shots):
    """Prints; -> seconds of the wall and of the processors, of decoding and of us."""
    folder, photos = make(goniocam, a.work, size_of(a.size), shots)
    floor = run([os.path.join(a.build, "tests/bench_decode"), str(a.threads)] + photos)
    ours, stages = reconstruct([goniocam], a.work, folder, "--threads", str(a.threads))
    print("%d shots x %d of %s, %d threads: decoding %.2f s, reconstruct %.2f s: %.2f x (processors: %.2f and %.2f s,"
          " %.2f x); peak memory %.0f MB" % (shots, len(EXPOSURES), a.size, a.threads, floor[0], ours[0],
                                             ours[0] / floor[0], floor[1], ours[1], ours[1] / floor[1], ours[2]))
    print("  " + ", ".join("%s %.2f (%.2f)" % (s["name"], s["seconds"], s["processor_seconds"]) for s in stages))
    return floor[:2], ours[:2]


def tell_further(few, many):
    """few, many: (shots, what measure() returned)."""
    (n, before), (m, after) = few, many
    for k, clock in enumerate(("the wall's clock", "the processors'")):
        floor, ours = ((after[i][k] - before[i][k]) / (m - n) for i in range(2))
        of_30 = (after[1][k] + (30 - m) * ours) / (after[0][k] + (30 - m) * floor)
        print("by %s a further shot takes %.2f s, decoding %.2f s: %.2f x; 30 shots would take %.2f x"
              % (clock, ours, floor, ours / floor, of_30))


def compare_ranks(a, goniocam, shots):
    folder, _ = make(goniocam, a.work, size_of(a.size), shots)
    one, _ = reconstruct([goniocam], a.work, folder, "--threads", "1")
    mpi = ["mpirun", "--allow-run-as-root", "--oversubscribe", "-n", str(a.ranks), goniocam + "-mpi"]
    many, _ = reconstruct(mpi, a.work, folder, "--threads", "1")
    print("%d shots: one thread %.2f s, %d ranks of one thread %.2f s: %.2f times as fast"
          % (shots, one[0], a.ranks, many[0], one[0] / many[0]))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(TOP, "build/release"))
    parser.add_argument("--goniocam")
    parser.add_argument("--work", default="/tmp/pipeline_scale")
    parser.add_argument("--size", default="6000x4000")
    parser.add_argument("--small", default="960x640")
    parser.add_argument("--shots", default="6")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--ranks", type=int, default=0)
    parser.add_argument("--memory", default="")
    a = parser.parse_args()
    goniocam = a.goniocam or os.path.join(a.build, "goniocam")
    counts = [int(n) for n in a.shots.split(",") if n != "0"]
    measured = [(shots, measure(a, goniocam, shots)) for shots in counts]
    if len(measured) == 2:
        tell_further(*measured)
    if a.ranks > 1:
        compare_ranks(a, goniocam, counts[0])
    for shots in (int(n) for n in a.memory.split(",") if n):
        folder, _ = make(goniocam, a.work, size_of(a.small), shots)
        peak = reconstruct([goniocam], a.work, folder, "--threads", str(a.threads))[0][2]
        print("%4d shots x %d of %s: peak memory %.0f MB" % (shots, len(EXPOSURES), a.small, peak))


if __name__ == "__main__":
    main()
