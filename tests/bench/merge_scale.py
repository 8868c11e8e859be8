#!/usr/bin/python3
"""Speed and error of the merge on synthetic 24-megapixel brackets, beside decoding and other programs.

    merge_scale.py [--build build/release] [--work /tmp/merge_scale] [--threads 2] [--others]

Writes 5 deflate-compressed 16-bit TIFF files of 6000 x 4000 (kept in --work), exposures a factor of 4 apart, a sensor of
12600 e full scale, 5 e read noise, 4 decades of radiance; then prints
  - seconds of decoding alone (bench_decode) and of `goniocam merge` on the same threads, and their ratio
  - per decade of radiance: rms error over the Cramer-Rao bound, bias, and the shares within 1 and 2 stated sigma
  - with --others: OpenCV's MergeDebevec and MergeRobertson (8 bits) and, where it is installed, pfshdrcalibrate.
"""
import argparse
import os
import shutil
import subprocess
import time

import cv2
import numpy as np

from merge_error import read_map

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
W, H, BLACK, GAIN, READ, WHITE = 6000, 4000, 128, 3.2, 5.0, 4095  # DN; e a DN; e; the converter's end
TIMES = [4.0 ** k / 1024 for k in range(5)]


def rate_row(y):
    """Electrons a second along a row: 4 decades across, the same for all rows and channels."""
    return 1.2e7 * 10 ** (-4 * (np.arange(W) + 0.5) / W)


def make(work):
    os.makedirs(work, exist_ok=True)
    rng = np.random.default_rng(1)
    for k, t in enumerate(TIMES):
        path = os.path.join(work, "a_%d.tif" % k)
        if os.path.exists(path):
            continue
        image = np.empty((H, W, 3), np.uint16)
        e = (rate_row(0) * t).astype(np.float32)[None, :, None]
        for y in range(0, H, 200):
            n = e + np.sqrt(e + READ * READ) * rng.standard_normal((200, W, 3), np.float32)
            image[y:y + 200] = np.clip(np.rint(BLACK + n / GAIN), 0, WHITE)
        cv2.imwrite(path, image, [cv2.IMWRITE_TIFF_COMPRESSION, 8])
    with open(os.path.join(work, "capture.yaml"), "w") as f:
        f.write('goniocam: 1\nphotos: {pattern: "*.tif"}\noverrides:\n')
        for k, t in enumerate(TIMES):
            f.write('- {photos: a_%d.tif, exposure_time: "%.10f"}\n' % (k, t))


def seconds(command):
    begin = time.monotonic()
    subprocess.check_call(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return time.monotonic() - begin


def decades(out):
    rate = rate_row(0)
    value, variance = read_map(os.path.join(out, "radiance", "a_0.exr"))
    read2 = READ ** 2 + GAIN ** 2 / 12
    information = np.zeros(W)
    for t in TIMES:
        used = rate * t + 4 * np.sqrt(rate * t + read2) < (WHITE - BLACK) * GAIN
        information += np.where(used, t * t / (rate * t + read2), 0)
    bound = 1 / np.sqrt(information) / rate
    print("  %-22s %11s %10s %8s %8s" % ("electrons in the longest", "rms / bound", "bias 1e-3", "1 sigma", "2 sigma"))
    for low in (1e2, 1e3, 1e4, 1e5, 1e6):
        x = (rate * TIMES[-1] >= low) & (rate * TIMES[-1] < 10 * low) & np.isfinite(bound)
        v, s = value[:, x, 1] / rate[x] * (WHITE - BLACK) * GAIN, np.sqrt(variance[:, x, 1])
        s = s / rate[x] * (WHITE - BLACK) * GAIN
        good = np.isfinite(s)
        error = v - 1
        w = 1 / bound[x] ** 2 * np.ones_like(v)
        bias = np.average(error[good], weights=w[good])
        z = np.abs(error - bias)[good] / s[good]
        norm = (error - bias) / bound[x]
        print("  %-22s %11.4f %10.4f %8.4f %8.4f" % ("%.0e to %.0e" % (low, 10 * low), np.sqrt(np.mean(norm[good] ** 2)),
                                                1e3 * bias, np.mean(z < 1), np.mean(z < 2)))
    return value


def others(work, ours_seconds, threads):
    cv2.setNumThreads(threads)
    files = [os.path.join(work, "a_%d.tif" % k) for k in range(5)]
    eight = [np.clip((cv2.imread(f, -1).astype(np.float32) - BLACK) * (255.0 / (WHITE - BLACK)), 0, 255).astype(np.uint8) for f in files]
    t = np.array(TIMES, np.float32)
    linear = np.repeat(np.arange(256, dtype=np.float32)[:, None, None], 3, 2) / 255
    rate = rate_row(0)[None, :, None]
    for name, merge in (("OpenCV Debevec", cv2.createMergeDebevec()), ("OpenCV Robertson", cv2.createMergeRobertson())):
        begin = time.monotonic()
        out = merge.process(eight, t, linear)
        took = time.monotonic() - begin
        ratio = out / rate
        ratio /= np.median(ratio[:, 200:-1500])
        error = np.sqrt(np.mean((ratio[:, 1000:3000] - 1) ** 2))
        print("  %-18s %8.2f s  %6.1f x ours, rms error %.4f (decades 2 and 3; 8 bits, reading excluded)" % (name, took, took / ours_seconds, error))
    if shutil.which("pfshdrcalibrate"):
        script = os.path.join(work, "list.hdrgen")
        with open(script, "w") as f:
            for k, s in enumerate(TIMES):
                f.write("%s %.8f 8.0 100 0\n" % (files[k], 1 / s))
        took = seconds(["sh", "-c", "pfsinhdrgen %s | pfshdrcalibrate -r linear --bpp 16 > %s/pfs.out" % (script, work)])
        print("  %-18s %8.2f s  %6.1f x ours (reading included)" % ("pfshdrcalibrate", took, took / ours_seconds))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(TOP, "build/release"))
    parser.add_argument("--goniocam")
    parser.add_argument("--work", default="/tmp/merge_scale")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--others", action="store_true")
    a = parser.parse_args()
    make(a.work)
    files = [os.path.join(a.work, "a_%d.tif" % k) for k in range(5)]
    decode = [os.path.join(a.build, "tests/bench_decode"), str(a.threads)] + files
    floor = min(float(subprocess.check_output(decode)) for _ in range(a.repeat))
    out, ours = os.path.join(a.work, "out"), float("inf")
    for _ in range(a.repeat):
        shutil.rmtree(out, ignore_errors=True)
        ours = min(ours, seconds([a.goniocam or os.path.join(a.build, "goniocam"), "merge", a.work, "-o", out, "--threads",
                                  str(a.threads), "--quiet"]))
    print("5 x 24 megapixels, deflate, %d threads: decoding %.2f s, merge %.2f s: %.2f x; %.2f ms a megapixel-exposure"
          % (a.threads, floor, ours, ours / floor, 1000 * ours / 5 / 24))
    decades(out)
    if a.others:
        others(a.work, ours, a.threads)


if __name__ == "__main__":
    main()
