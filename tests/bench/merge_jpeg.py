#!/usr/bin/python3
"""Radiance from JPEG brackets against that from linear TIFF brackets of the same scene.

    merge_jpeg.py JPEG_OUT TIFF_OUT      as `goniocam merge CAPTURE/jpeg -o JPEG_OUT` wrote them

Over pixels that are well exposed in at least one frame: unsaturated, and within 5 % to 90 % of the scale in the longest
frame that is not saturated there. One factor a channel is free (a response curve has none of its own). Issue 4 asks for
a median of at most 1 % and 95 % at most 4 %; 68 % within 1 stated sigma, 95 % within 2: of the difference, whose
variance is that of both maps. (The encoder smooths noise away that the linear map still has. Of the JPEG's variance
alone, printed last, fewer have to be within. Against truth: merge_encoded.py.)
"""
import glob
import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from merge_error import read_map  # noqa: E402


def times_of(path):
    s = open(path, "rb").read(4096)
    at = s.index(b"goniocam:times\0string\0") + len(b"goniocam:times\0string\0")
    size = int.from_bytes(s[at:at + 4], "little")
    return sorted(float(t) for t in s[at + 4:at + 4 + size].split())


def main():
    ours, theirs = sys.argv[1:3]
    errors, both, alone = [[], [], []], [[], [], []], [[], [], []]
    for path in sorted(glob.glob(os.path.join(ours, "radiance", "*.exr"))):
        other = os.path.join(theirs, "radiance", os.path.basename(path))
        if not os.path.exists(other):
            continue
        a, va = read_map(path)
        b, vb = read_map(other)
        level = np.zeros(a.shape)
        for t in times_of(path):
            level = np.where(b * t < 0.9, np.maximum(level, b * t), level)
        good = np.isfinite(va) & np.isfinite(vb) & (level > 0.05)
        for c in range(3):
            g = good[..., c]
            errors[c].append(a[..., c][g] / b[..., c][g])
            alone[c].append(np.sqrt(va[..., c][g]) / a[..., c][g])
            both[c].append(np.hypot(alone[c][-1], np.sqrt(vb[..., c][g]) / b[..., c][g]))
    print("%-3s %10s %10s %10s %9s %9s %10s %15s" % ("", "scale", "median %", "95 %", "1 sigma", "2 sigma", "pixels",
                                                     "JPEG's alone"))
    for c, name in enumerate("RGB"):
        e = np.concatenate(errors[c])
        scale = np.median(e)
        d = np.abs(e / scale - 1)
        z, za = d / np.concatenate(both[c]), d / np.concatenate(alone[c])
        print("%-3s %10.5f %10.3f %10.3f %9.3f %9.3f %10d %9.3f %5.3f" % (
            name, scale, 100 * np.median(d), 100 * np.quantile(d, 0.95), np.mean(z < 1), np.mean(z < 2), d.size,
            np.mean(za < 1), np.mean(za < 2)))


if __name__ == "__main__":
    main()
