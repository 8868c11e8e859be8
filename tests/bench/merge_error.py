#!/usr/bin/python3
"""Error of goniocam's merge against a shared capture's noise-free radiance.

    merge_error.py OUT CAPTURE      e.g. /tmp/out ../shared/captures/plastic-sphere-direct

OUT holds radiance/SHOT_exp0.exr as `goniocam merge CAPTURE/tiff -o OUT` writes them; CAPTURE holds
truth.json and radiance/SHOT.exr. Printed per channel, over photosites that the brackets expose well:

  rms / bound   relative rms error over that of the Cramer-Rao bound, from the sensor's true noise and
                all frames that are not saturated
  bias          of the mean, in per mille
  1 sigma, 2 sigma   share of photosites within the stated standard deviation (0.683, 0.954 wanted)
"""
import json
import os
import struct
import sys

import numpy as np

# Beside the project, or beside the folder of its worktrees.
for _up in ("../../../shared/judge", "../../../../shared/judge"):
    sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), _up))
import capio  # noqa: E402


def read_map(path):
    """value and variance, [h][w][3]: uncompressed scan lines of B, G, R, var.B, var.G, var.R."""
    s = open(path, "rb").read()
    p, w, h = 8, 0, 0
    while s[p] != 0:
        q = s.index(b"\0", p); name = s[p:q]; p = q + 1
        p = s.index(b"\0", p) + 1
        n, = struct.unpack_from("<i", s, p); p += 4
        if name == b"dataWindow":
            x0, y0, x1, y1 = struct.unpack_from("<4i", s, p)
            w, h = x1 - x0 + 1, y1 - y0 + 1
        p += n
    a = np.frombuffer(s, np.uint8, offset=p + 1 + 8 * h).reshape(h, 8 + w * 24)[:, 8:]
    a = np.ascontiguousarray(a).view("<f4").reshape(h, 6, w).transpose(0, 2, 1)
    return a[..., 2::-1].astype(np.float64), a[..., 5:2:-1].astype(np.float64)


def true_dn_per_second(truth, radiance):
    """DN above black a second that the sensor gets, and the vignetting."""
    cam, sensor = truth["camera"], truth["sensor"]
    h, w, _ = radiance.shape
    y, x = np.mgrid[0:h, 0:w]
    q = ((x - cam["cx"]) ** 2 + (y - cam["cy"]) ** 2) / ((w / 2) ** 2 + (h / 2) ** 2)
    v = 1 + sum(c * q ** (k + 1) for k, c in enumerate(sensor["vignetting"]))
    rate = radiance * np.array(sensor["channel_gain"]) * sensor["electrons_per_radiance_second"]
    return rate * sensor["dn_per_electron"], v[..., None] / v.max()


def bound(truth, dn):
    """Relative standard deviation of the best unbiased estimate, and where it may be judged."""
    sensor = truth["sensor"]
    k = sensor["dn_per_electron"]
    read2 = (sensor["read_noise_e"] * k) ** 2 + 1 / 12
    full = min(sensor["full_well"] * k, sensor["adc_max"] - sensor["black_level"])
    information, longest = 0, 0
    for t in truth["exposure_times"]:
        used = dn * t < full - 4 * np.sqrt(full * k)
        information = information + np.where(used, t * t / (read2 + dn * t * k), 0)
        longest = np.where(used, dn * t, longest)
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = 1 / np.sqrt(information) / dn
    return relative, (longest > 50) & np.isfinite(relative)


def main():
    out, capture = sys.argv[1:3]
    truth = json.load(open(os.path.join(capture, "truth.json")))
    print("%-12s %-3s %11s %10s %8s %8s %9s" % ("shot", "", "rms / bound", "bias 1e-3", "1 sigma",
                                                "2 sigma", "photosites"))
    for shot in truth["shots"]:
        exact = os.path.join(capture, shot["radiance"]) if shot.get("radiance") else ""
        name = "shot%02d_exp0" % shot["index"]
        ours = os.path.join(out, "radiance", name + ".exr")
        if not os.path.exists(exact) or not os.path.exists(ours):
            continue
        rate, vignetting = true_dn_per_second(truth, capio.exr_read(exact).astype(np.float64))
        value, variance = read_map(ours)
        # One scale a channel is free: the map's unit is the full scale that was found.
        for c, channel in enumerate("RGB"):
            relative, good = bound(truth, (rate * vignetting)[..., c])
            good &= np.isfinite(variance[..., c]) & (rate[..., c] > 0)
            full = np.full(good.shape, truth["sensor"]["adc_max"] - truth["sensor"]["black_level"])
            error = value[..., c][good] * full[good] / rate[..., c][good] - 1
            # Photosites of equal weight in the mean's precision.
            weight = 1 / relative[good] ** 2
            bias = np.sum(weight * error) / np.sum(weight)
            stated = np.sqrt(variance[..., c][good]) * full[good] / rate[..., c][good]
            z = np.abs(error - bias) / stated
            print("%-12s %-3s %11.4f %10.4f %8.4f %8.4f %9d" % (
                name, channel, np.sqrt(np.mean((error - bias) ** 2) / np.mean(relative[good] ** 2)),
                1e3 * bias, np.mean(z < 1), np.mean(z < 2), good.sum()))


if __name__ == "__main__":
    main()
