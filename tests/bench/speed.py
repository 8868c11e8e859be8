#!/usr/bin/python3
"""Time of goniocam reconstruct and merge on a capture of TIFF files, beside the time of decoding them.

    tests/bench/speed.py [CAPTURE] [--build build/release] [--threads 2] [--repeat 3]

CAPTURE defaults to ../shared/captures/plastic-sphere-direct/tiff. Ratios mean more than seconds on a shared machine;
the best of all repeats counts. Issue 2 asks for reconstruct in at most 4 x decoding + 5 s.
"""
import argparse
import glob
import os
import subprocess
import tempfile
import time

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))


def seconds(command):
    begin = time.monotonic()
    subprocess.check_call(command, stdout=subprocess.DEVNULL)
    return time.monotonic() - begin


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("capture", nargs="?", default=os.path.join(TOP, "../shared/captures/plastic-sphere-direct/tiff"))
    parser.add_argument("--build", default=os.path.join(TOP, "build/release"))
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--repeat", type=int, default=3)
    a = parser.parse_args()
    files = sorted(glob.glob(os.path.join(a.capture, "*.tif")))
    decode = [os.path.join(a.build, "tests/bench_decode"), str(a.threads)] + files
    floor = min(float(subprocess.check_output(decode)) for _ in range(a.repeat))
    print("%d files, %d threads\n  %-12s %8.2f s" % (len(files), a.threads, "decoding", floor))
    for command in ("merge", "reconstruct"):
        best = float("inf")
        for _ in range(a.repeat):
            with tempfile.TemporaryDirectory() as out:
                best = min(best, seconds([os.path.join(a.build, "goniocam"), command, a.capture, "-o", out,
                                          "--threads", str(a.threads), "--quiet"]))
        print("  %-12s %8.2f s   %5.2f x decoding" % (command, best, best / floor))
    print("  asked of reconstruct: %.2f s" % (4 * floor + 5))


if __name__ == "__main__":
    main()
