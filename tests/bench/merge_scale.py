#!/usr/bin/python3
"""Speed, memory and error of the merge on synthetic 24-megapixel brackets, beside decoding and other programs.

    merge_scale.py [--build build/release] [--work /tmp/merge_scale] [--threads 2] [--kinds tiff,dng,plain] [--shots 3]
                   [--others]

Makes brackets of 5 exposures, a factor of 4 apart, of 6000 x 4000 in --work (kept there): 4 decades of radiance on a
sensor of 12600 e full scale with 5 e read noise, as 16-bit RGB TIFF (deflate; uncompressed: `plain`) and as a mosaic in
lossless-JPEG DNG. For each kind it prints
  - seconds of decoding alone (bench_decode: libtiff, LibRaw) and of `goniocam merge` on the same threads (best of
    --repeat, one after the other), and their ratio (asked: at most 1.5); the same of user and system time
  - milliseconds a megapixel-exposure, beside what copying as many bytes as are read and written takes in memory
  - the peak memory of merging one shot and --shots shots, in float images of the frame (asked: below 3, and the same)
and of the TIFF, per decade of radiance, the rms error over the Cramer-Rao bound, bias, and the shares within 1
and 2 stated sigma. --others compares, each from TIFF files to its result, decoding included: goniocam merge
(which estimates the sensor's levels and noise, and writes its map with variances); OpenCV's MergeDebevec and
MergeRobertson (8 bits are all that they take; their result stays in memory) and pfshdrcalibrate (16 bits; its result
goes into a pipe), where they are installed. Those know no black level: they get files it has been taken from, and the
linear response and true times. Printed: seconds, and the rms relative error where the longest frame holds 10^4 to 10^6
electrons, each program's own scale taken out by its median.
"""
import argparse
import os
import shutil
import subprocess
import sys
import time

import cv2
import numpy as np

from lossless_jpeg import lossless_jpeg
from merge_error import read_map
from merge_synthetic import write_dng

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
W, H, BLACK, GAIN, READ, WHITE = 6000, 4000, 128, 3.2, 5.0, 4095  # DN; e a DN; e; the converter's end
TIMES = [4.0 ** k / 1024 for k in range(5)]
KINDS = {"tiff": ("tif", 3, "deflate TIFF"), "dng": ("dng", 1, "lossless-JPEG DNG"), "plain": ("tif", 3, "uncompressed TIFF")}


def rate_row():
    """Electrons a second along a row: 4 decades across, the same for all rows and channels."""
    return 1.2e7 * 10 ** (-4 * (np.arange(W) + 0.5) / W)


def write(path, kind, dn, seconds):
    if kind == "dng":
        write_dng(path, dn[..., 0], seconds, WHITE, lossless_jpeg(dn[..., 0], 12))
    else:
        cv2.imwrite(path, dn, [cv2.IMWRITE_TIFF_COMPRESSION, 8 if kind == "tiff" else 1])


def make(work, kind, shots):
    """A folder of one bracket, and one of so many that share its files; -> the files of the first."""
    end, channels, _ = KINDS[kind]
    rng = np.random.default_rng(1)
    files = [os.path.join(work, kind, "s0_%d.%s" % (k, end)) for k in range(5)]
    for folder, count in ((kind, 1), (kind + "_more", shots)):
        os.makedirs(os.path.join(work, folder), exist_ok=True)
        with open(os.path.join(work, folder, "capture.yaml"), "w") as f:
            f.write('goniocam: 1\nphotos: {pattern: "*.%s"}\noverrides:\n' % end)
            for k, t in enumerate(TIMES):
                f.write('- {photos: "*_%d.%s", exposure_time: "%.10f"}\n' % (k, end, t))
    for k, t in enumerate(TIMES):
        if not os.path.exists(files[k]):
            image = np.empty((H, W, channels), np.uint16)
            e = (rate_row() * t).astype(np.float32)[None, :, None]
            for y in range(0, H, 200):
                n = e + np.sqrt(e + READ * READ) * rng.standard_normal((200, W, channels), np.float32)
                image[y:y + 200] = np.clip(np.rint(BLACK + n / GAIN), 0, WHITE)
            write(files[k], kind, image, t)
        for s in range(shots):
            link = os.path.join(work, kind + "_more", "s%d_%d.%s" % (s, k, end))
            if not os.path.exists(link):
                os.link(files[k], link)
    return files


def run(command):
    """Seconds, seconds of the processors, megabytes at the peak."""
    begin = time.monotonic()
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, code, used = os.wait4(child.pid, 0)
    if code:
        raise SystemExit("failed: " + " ".join(command))
    return time.monotonic() - begin, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


COPYING = """
import sys, time
import numpy as np
a = np.ones(int(sys.argv[1]) // 2, np.uint8)
b = np.empty_like(a)
best = float("inf")
for _ in range(4):
    begin = time.monotonic()
    np.copyto(b, a)
    best = min(best, time.monotonic() - begin)
print(best)
"""


def copying(size):
    """Seconds of copying so many bytes in all, read and written, in memory; in a process of its own, for the peaks of others."""
    return float(subprocess.check_output([sys.executable, "-c", COPYING, str(size)]))


def merge(a, kind, folder):
    out = os.path.join(a.work, "out_" + folder)
    shutil.rmtree(out, ignore_errors=True)
    return run([a.goniocam or os.path.join(a.build, "goniocam"), "merge", os.path.join(a.work, folder), "-o", out,
                "--threads", str(a.threads), "--quiet"])


def measure(a, kind):
    """Prints; -> seconds of merging one shot."""
    files, channels = make(a.work, kind, a.shots), KINDS[kind][1]
    decode = [os.path.join(a.build, "tests/bench_decode"), str(a.threads)] + files
    both = [(run(decode), merge(a, kind, kind)) for _ in range(a.repeat)]
    floor, ours = (min(b[i][0] for b in both) for i in range(2))
    floor_cpu, ours_cpu = (min(b[i][1] for b in both) for i in range(2))
    one, many = max(b[1][2] for b in both), merge(a, kind, kind + "_more")[2]
    print("5 x 24 megapixels, %s, %d threads" % (KINDS[kind][2], a.threads))
    print("  decoding %.2f s, merge %.2f s: %.2f x (processors: %.2f and %.2f s, %.2f x)"
          % (floor, ours, ours / floor, floor_cpu, ours_cpu, ours_cpu / floor_cpu))
    moved = W * H * channels * (2 * 5 + 8)  # 16 bits in, value and variance out
    print("  %.2f ms a megapixel-exposure; copying its %d MB in memory: %.2f ms"
          % (1000 * ours / 120, moved >> 20, 1000 * copying(moved) / 120))
    image = 4 * W * H * channels / 2 ** 20
    print("  peak memory %.0f MB of one shot, %.0f MB of %d: %.2f and %.2f float images"
          % (one, many, a.shots, one / image, many / image))
    return ours


def ours_of(work, kind):
    value, variance = read_map(os.path.join(work, "out_" + kind, "radiance", "s0_0.exr"))
    return value[::16], variance[::16]  # enough to tell


def decades(value, variance):
    rate = rate_row()
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


def error_of(value):
    """rms relative error where the longest frame holds 10^4 to 10^6 electrons, but for the scale; value [..][W][3]."""
    rate = rate_row()
    x = (rate * TIMES[-1] >= 1e4) & (rate * TIMES[-1] < 1e6)
    ratio = value[:, x] / rate[x][None, :, None]
    return np.sqrt(np.mean((ratio / np.median(ratio) - 1) ** 2))


def tell(name, seconds, ours, error):
    print("  %-18s %8.2f s  %6.1f x ours  rms error %.4f" % (name, seconds, seconds / ours, error))


def without_black(files, work, kind):
    """The same photographs from 0 to 65535."""
    made = [os.path.join(work, "others_%s_%d.tif" % (kind, k)) for k in range(5)]
    for f, to in zip(files, made):
        if not os.path.exists(to):
            dn = cv2.subtract(cv2.imread(f, -1), (BLACK,) * 4)
            full = np.rint(dn * np.float32(65535 / (WHITE - BLACK))).astype(np.uint16)
            cv2.imwrite(to, full, [cv2.IMWRITE_TIFF_COMPRESSION, 8 if kind == "tiff" else 1])
    return made


def by_opencv(files, algorithm):
    """Reading, 8 bits, merging."""
    begin = time.monotonic()
    eight = []
    for f in files:
        eight.append(cv2.convertScaleAbs(cv2.imread(f, -1), alpha=1 / 257))
    linear = np.repeat(np.arange(256, dtype=np.float32)[:, None, None], 3, 2).clip(0.5) / 255  # it takes logarithms
    out = algorithm.process(eight, np.array(TIMES, np.float32), linear)
    return time.monotonic() - begin, out[::16]


def pfs_value(data):
    """[rows][W][3] of a PFS stream, whose channels X, Y, Z are sRGB's mixes of red, green, blue: every 16th row."""
    xyz_of_rgb = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    planes = np.frombuffer(data, "<f4", 3 * W * H, data.index(b"ENDH") + 4).reshape(3, H, W)[:, ::16]
    return np.einsum("ij,jyx->yxi", np.linalg.inv(xyz_of_rgb), planes)


def by_pfstools(files, work):
    """Reading and merging; the result stays in a pipe."""
    script = os.path.join(work, "list.hdrgen")
    with open(script, "w") as f:
        for k, s in enumerate(TIMES):
            f.write("%s %.8f 8.0 100 0\n" % (files[k], 1 / s))
    begin = time.monotonic()
    data = subprocess.check_output("pfsinhdrgen %s | pfshdrcalibrate -r linear --bpp 16" % script, shell=True,
                                   stderr=subprocess.DEVNULL)
    return time.monotonic() - begin, data


def others(a, kind, ours, value):
    print("from the files to the result, %s:" % KINDS[kind][2])
    tell("goniocam merge", ours, ours, error_of(value))
    cv2.setNumThreads(a.threads)
    files = without_black(make(a.work, kind, a.shots), a.work, kind)
    for name, algorithm in (("OpenCV Debevec", cv2.createMergeDebevec()), ("OpenCV Robertson", cv2.createMergeRobertson())):
        took, out = by_opencv(files, algorithm)
        tell(name, took, ours, error_of(out))
    if shutil.which("pfshdrcalibrate"):
        took, data = by_pfstools(files, a.work)
        tell("pfshdrcalibrate", took, ours, error_of(pfs_value(data)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(TOP, "build/release"))
    parser.add_argument("--goniocam")
    parser.add_argument("--work", default="/tmp/merge_scale")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--kinds", default="dng,plain,tiff")
    parser.add_argument("--shots", type=int, default=3)
    parser.add_argument("--others", action="store_true")
    a = parser.parse_args()
    kinds = a.kinds.split(",")
    ours = {kind: measure(a, kind) for kind in kinds}
    for kind in kinds:  # after the measuring: a child's peak of memory includes that of what forked it
        if kind == "dng":
            continue
        value, variance = ours_of(a.work, kind)
        print("merged from " + KINDS[kind][2])
        decades(value, variance)
        if a.others:
            others(a, kind, ours[kind], value)


if __name__ == "__main__":
    main()
