#!/usr/bin/python3
"""Radiance and stated variance of encoded brackets against truth, over JPEG qualities and subsampling.

    merge_encoded.py GONIOCAM SHARED [QUALITY-SUBSAMPLING[-NOISE] ...]      e.g. 95-420 75-444 95-420-8 png

Brackets of the noise-free radiance of SHARED/captures/plastic-sphere-direct are exposed with the sensor of its
truth.json (NOISE: with so many times fewer electrons), encoded as sRGB, written by Pillow (python3-pil) and merged.
Printed per channel, over pixels within 5 % to 90 % of the scale in the longest frame that is not saturated there, one
factor a channel free: median and 95 % of the relative difference, and the shares within 1 and 2 stated standard
deviations, of all pixels, then of those whose 9 x 9 neighbours differ by less and by more than 5 %.
"""
import glob
import json
import os
import subprocess
import sys
import tempfile

import numpy as np
from PIL import Image
from scipy.ndimage import maximum_filter, minimum_filter

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from merge_error import capio, read_map, true_dn_per_second  # noqa: E402

SHOTS = (0, 6, 14)


def srgb(v):
    return np.where(v <= 0.0031308, 12.92 * v, 1.055 * np.maximum(v, 1e-9) ** (1 / 2.4) - 0.055)


def codes(rate, seconds, sensor, fewer, random):
    """What a sensor with `fewer` times fewer electrons makes of a rate in DN a second."""
    dn_per_electron = sensor["dn_per_electron"] * fewer
    electrons = random.poisson(np.clip(np.nan_to_num(rate * seconds / dn_per_electron), 0, 1e7)).astype(float)
    electrons = np.minimum(electrons, sensor["full_well"] / fewer) + random.normal(0, sensor["read_noise_e"], rate.shape)
    full = sensor["adc_max"] - sensor["black_level"]
    return np.round(255 * srgb(np.clip(np.round(electrons * dn_per_electron) / full, 0, 1))).astype(np.uint8)


def expose(folder, form, truth, rates):
    kind, subsampling, fewer = [a or b for a, b in zip(form.split("-") + [None] * 2, ("", "444", "1"))]
    random, lines = np.random.default_rng(3), []
    for shot, rate in rates.items():
        for k, seconds in enumerate(truth["exposure_times"]):
            name = "shot%02d_exp%d.%s" % (shot, k, "png" if kind == "png" else "jpg")
            image = Image.fromarray(codes(rate, seconds, truth["sensor"], float(fewer), random))
            options = {} if kind == "png" else {"quality": int(kind), "subsampling": {"420": 2, "422": 1, "444": 0}[subsampling]}
            image.save(os.path.join(folder, name), **options)
            lines.append("- {photos: %s, exposure_time: %.9g}\n" % (name, seconds))
    with open(os.path.join(folder, "capture.yaml"), "w") as f:
        f.write('goniocam: 1\nphotos: {pattern: "shot*"}\noverrides:\n' + "".join(lines))


def judge(out, truth, rates):
    full = truth["sensor"]["adc_max"] - truth["sensor"]["black_level"]
    rows = [[], [], []]
    for shot, rate in rates.items():
        value, variance = read_map(glob.glob(os.path.join(out, "radiance", "shot%02d*.exr" % shot))[0])
        due, level = rate / full, np.zeros(rate.shape)
        for t in truth["exposure_times"]:
            level = np.where(due * t < 0.9, np.maximum(level, due * t), level)
        range_ = maximum_filter(due, (9, 9, 1)) / np.maximum(minimum_filter(due, (9, 9, 1)), 1e-9) - 1
        for c in range(3):
            good = np.isfinite(variance[..., c]) & (level[..., c] > 0.05)
            rows[c].append(np.stack([a[..., c][good] for a in (value, np.sqrt(variance), due, range_)]))
    for c in range(3):
        value, sigma, due, range_ = np.concatenate(rows[c], 1)
        scale = np.median(value / due)
        z, off, still = np.abs(value - scale * due) / sigma, np.abs(value / due / scale - 1), range_ < 0.05
        print("  %s %8.3f %7.3f   " % ("RGB"[c], 100 * np.median(off), 100 * np.quantile(off, 0.95))
              + "   ".join("%.3f %.3f" % (np.mean(k < 1), np.mean(k < 2)) for k in (z, z[still], z[~still])))


def main():
    goniocam, shared = sys.argv[1:3]
    capture = os.path.join(shared, "captures", "plastic-sphere-direct")
    truth = json.load(open(os.path.join(capture, "truth.json")))
    rates = {}
    for shot in SHOTS:
        rate, vignetting = true_dn_per_second(truth, capio.exr_read(
            os.path.join(capture, "radiance", "shot%02d.exr" % shot)).astype(np.float64))
        rates[shot] = np.maximum(rate * vignetting, 0)
    print("    median %    95 %   1, 2 sigma: all    still         structured")
    for form in sys.argv[3:] or ["75-420", "75-444", "90-420", "90-444", "95-420", "95-444", "100-420", "100-444", "png"]:
        with tempfile.TemporaryDirectory() as folder:
            expose(folder, form, truth, rates)
            out = os.path.join(folder, "out")
            subprocess.check_call([goniocam, "merge", folder, "-o", out, "--quiet"], stdout=subprocess.DEVNULL)
            print(form)
            judge(out, truth, rates)


if __name__ == "__main__":
    main()
