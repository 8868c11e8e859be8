#!/usr/bin/python3
"""Peak memory of merging and calibrating 300 shots beside 30 of the same photographs (issue 5: no more).

    tests/bench/calibration_memory.py [--goniocam build/release/goniocam] [--few 30] [--many 300] [--threads 2]

Six small photographs (samples/tiny.yaml, two exposures each) are hard-linked under as many names as there are shots.
Prints the peak resident memory of `goniocam calibrate` (VmHWM, as the kernel counted it) and what a shot more costs, of
which its merged map in memory would be most: that is printed beside it.
"""
import argparse
import os
import subprocess
import sys
import tempfile

import yaml

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))


def repeat(source, folder, shots):
    """A capture of so many shots that are links to the photographs of a few."""
    os.makedirs(folder)
    files = sorted(f for f in os.listdir(source) if f.endswith(".tif"))
    names = sorted({f.split("_")[0] for f in files})
    for i in range(shots):
        for f in files:
            if f.startswith(names[i % len(names)] + "_"):
                os.link(os.path.join(source, f), os.path.join(folder, "shot%04d_%s" % (i, f.split("_")[1])))
    with open(os.path.join(source, "capture.yaml")) as f:
        capture = yaml.safe_load(f)
    capture.pop("lights")  # one lamp, whatever the shots are called
    with open(os.path.join(folder, "capture.yaml"), "w") as f:
        yaml.safe_dump(capture, f)


def peak(goniocam, capture, out, threads):
    """MB of one run: its own child's, so each is measured in a process of its own."""
    code = ("import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL); "
            "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)")
    done = subprocess.run([sys.executable, "-c", code, goniocam, "calibrate", capture, "-o", out, "--quiet", "--threads",
                           str(threads)], stdout=subprocess.PIPE, text=True, check=True)
    return int(done.stdout) / 1024


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--goniocam", default=os.path.join(TOP, "build/release/goniocam"))
    parser.add_argument("--few", type=int, default=30)
    parser.add_argument("--many", type=int, default=300)
    parser.add_argument("--threads", type=int, default=2)
    a = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scene = yaml.safe_load(open(os.path.join(TOP, "samples/tiny.yaml")))
        scene["exposures"] = scene["exposures"][1:]
        with open(folder + "/scene.yaml", "w") as f:
            yaml.safe_dump(scene, f)
        subprocess.run([a.goniocam, "render", folder + "/scene.yaml", "-o", folder + "/six", "--quiet"], check=True,
                       stdout=subprocess.DEVNULL)
        used = {}
        for shots in (a.few, a.many):
            repeat(folder + "/six", folder + "/%d" % shots, shots)
            used[shots] = peak(a.goniocam, folder + "/%d" % shots, folder + "/out%d" % shots, a.threads)
            print("%4d shots: %7.1f MB at most" % (shots, used[shots]), flush=True)
    width, height = scene["camera"]["size"]
    print("a shot more: %.3f MB (its map: %.1f MB)" % ((used[a.many] - used[a.few]) / (a.many - a.few),
                                                      width * height * 24 / 2 ** 20))
    print("ratio: %.2f" % (used[a.many] / used[a.few]))


if __name__ == "__main__":
    main()
