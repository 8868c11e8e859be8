#!/usr/bin/python3
"""Fits to tables of the 100 published SGD materials: how near, how they look, how long it takes.

    tests/bench/fit_table.py [--every 1] [--models sgd,ggx2] [--build build/release] [--rows]

--every 10 takes every tenth material; --models all fits the whole list. Issue 7 asks: SGD within 1 % (median relative
error) on 95 of 100; ggx2 with a PSNR of 41 dB on the median material and 38 dB on 90 of 100, in 5 s; the whole list in 20 s
on two idle cores; sampling by the table with at most 1.5 times the variance of the best model's lobes.
"""
import argparse
import collections
import os
import subprocess

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
COSTS = ["statistical", "log", "cube-root", "picture"]


def quantile(values, q):
    values = sorted(values)
    return values[min(len(values) - 1, int(q * len(values)))]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--models", default="sgd,ggx2")
    parser.add_argument("--cost", default="picture", choices=COSTS, help="as goniocam fit's; default picture, as of tables")
    parser.add_argument("--build", default=os.path.join(TOP, "build/release"))
    parser.add_argument("--data", default=os.path.join(TOP, "../shared/data/sgd_abc.json"))
    parser.add_argument("--rows", action="store_true", help="every material's figures too")
    a = parser.parse_args()
    text = subprocess.check_output([os.path.join(a.build, "tests/bench_fits"), a.data, a.models, str(a.every), str(COSTS.index(a.cost))], text=True)
    models, sampling, times = collections.defaultdict(list), [], {}
    for line in text.splitlines():
        word = line.split()
        if a.rows:
            print(line)
        if word[1] == "sampling":
            sampling += [float(x) for x in word[2:]]
        else:
            models[word[1]].append([float(x) for x in word[2:]])
            times[word[0]] = (float(word[2]), float(word[3]))
    n = len(times)
    print("%d materials; fits of all models together: processor time median %.1f s, most %.1f s; by the clock %.1f, %.1f s"
          % (n, quantile([t[0] for t in times.values()], 0.5), max(t[0] for t in times.values()),
             quantile([t[1] for t in times.values()], 0.5), max(t[1] for t in times.values())))
    print("%-26s %22s %9s %30s %12s %12s" % ("model", "median error %: half", "<1 %", "PSNR lamp: half, 10th, worst", "delta E",
                                           "PSNR room"))
    for name, rows in models.items():
        error, psnr = [r[2] for r in rows], [r[3] for r in rows]
        print("%-26s %22.3f %5d/%-3d %14.1f %7.1f %7.1f %12.2f %12.1f"
              % (name, quantile(error, 0.5), sum(e < 1 for e in error), n, quantile(psnr, 0.5), quantile(psnr, 0.1), min(psnr),
                 quantile([r[4] for r in rows], 0.5), quantile([r[5] for r in rows], 0.5)))
        if name == "ggx2":
            print("%-26s %d of %d at 38 dB or more" % ("", sum(p >= 38 for p in psnr), n))
    print("variance by the table's own sampling over that by the best model's lobes: median %.2f, 95 %% %.2f, worst %.2f"
          % (quantile(sampling, 0.5), quantile(sampling, 0.95), max(sampling)))


if __name__ == "__main__":
    main()
