#!/usr/bin/python3
"""Lines a second of goniocam eval as a filter, and evaluations a second of the C face beside it.

    tests/bench/eval_speed.py BRDF [--build build/release] [--lines 2000000]

BRDF is a MERL table, a fits.yaml or OUT. Processor time of one thread, start and reading of the table included. Issue 7
asks for millions of lines, and 20 million evaluations of a table, a second and core.
"""
import argparse
import os
import random
import resource
import subprocess
import tempfile

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("brdf")
    parser.add_argument("--build", default=os.path.join(TOP, "build/release"))
    parser.add_argument("--lines", type=int, default=2000000)
    a = parser.parse_args()
    random.seed(1)
    with tempfile.TemporaryFile("w+") as lines:
        for _ in range(a.lines):
            lines.write("%.6g %.6g %.6g\n" % (random.uniform(0, 90), random.uniform(0, 90), random.uniform(0, 360)))
        lines.seek(0)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.check_call([os.path.join(a.build, "goniocam"), "eval", a.brdf, "--threads", "1"], stdin=lines,
                              stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print("%-34s %8.1f million lines a second" % ("goniocam eval", 1e-6 * a.lines / spent))
    subprocess.check_call([os.path.join(a.build, "tests/bench_eval"), a.brdf])


if __name__ == "__main__":
    main()
