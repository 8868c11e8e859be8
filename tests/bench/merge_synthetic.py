#!/usr/bin/python3
"""goniocam's merge of synthetic brackets against the Cramer-Rao bound, by decades of radiance.

    merge_synthetic.py GONIOCAM     prints issue 4's table: 12 and 14 bit raw (DNG), low to high light,
                                    exposure times as stated and up to 7 % off, nothing known of the sensor; and one of
                                    unequal photosites with a flat frame

Per decade, from the darkest radiance whose longest frame holds 20 electrons on, and before them of photosites that in one
frame are within 5 standard deviations of saturation (the bound is that of the frames below), the worst channel of:
  rms    relative rms error over that of the bound, from the sensor's true noise and all frames that do not saturate
         (asked: within 0.02 of 1)
  bias   of the mean, % (asked: below 0.1), over that of the best linear estimate from the same photographs, which knows the
         sensor and the radiance: it is unbiased, and has the noise that a few shots leave in a mean
  1s 2s  share of photosites within 1 and 2 stated standard deviations (asked: 0.683 and 0.954, to 0.02)
  times  largest error of the exposure times' ratios, % (asked: 0.2)
The saturation level is a full well below the converter's maximum that the file states; the file states no black level.
"""
import os
import struct
import subprocess
import sys
import tempfile

import numpy as np

WIDTH, HEIGHT, SHOTS = 960, 640, 4


def write_dng(path, dn, seconds, white, packed=None):
    """One uncompressed strip of 16 bits, RGGB, with the tags that LibRaw wants; packed: the strip as lossless JPEG."""
    h, w = dn.shape
    text = lambda s: s.encode() + b"\0"
    entries, blob = [], bytearray()

    def add(tag, kind, values):
        data = values if isinstance(values, bytes) else b"".join(
            struct.pack("<" + {1: "B", 3: "H", 4: "I", 5: "II", 10: "ii"}[kind], *(v if isinstance(v, tuple) else (v,))) for v in values)
        entries.append((tag, kind, len(data) // {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 10: 8}[kind], data))

    add(254, 4, [0]); add(256, 4, [w]); add(257, 4, [h]); add(258, 3, [16]); add(259, 3, [7 if packed else 1]); add(262, 3, [32803])
    add(271, 2, text("Synthetic")); add(272, 2, text("Sensor")); add(273, 4, [0]); add(274, 3, [1]); add(277, 3, [1])
    add(278, 4, [h]); add(279, 4, [len(packed) if packed else 2 * w * h]); add(33421, 3, [2, 2]); add(33422, 1, [0, 1, 1, 2])
    add(34665, 4, [0]); add(50706, 1, [1, 4, 0, 0]); add(50707, 1, [1, 1, 0, 0]); add(50708, 2, text("Synthetic Sensor"))
    add(50713, 3, [1, 1]); add(50714, 3, [0]); add(50717, 4, [white])
    add(50721, 10, [(1, 1), (0, 1), (0, 1), (0, 1), (1, 1), (0, 1), (0, 1), (0, 1), (1, 1)])
    add(50728, 5, [(1, 1), (1, 1), (1, 1)]); add(50778, 3, [21])
    exif = 8 + 2 + 12 * len(entries) + 4
    after = exif + 2 + 12 * 2 + 4
    out = bytearray(b"II*\0" + struct.pack("<I", 8) + struct.pack("<H", len(entries)))
    blobs = sum(len(e[3]) + len(e[3]) % 2 for e in entries if len(e[3]) > 4)
    strip = after + blobs + 8
    for tag, kind, count, data in sorted(entries):
        data = {273: struct.pack("<I", strip), 34665: struct.pack("<I", exif)}.get(tag, data)
        out += struct.pack("<HHI", tag, kind, count)
        if len(data) > 4:
            out += struct.pack("<I", after + len(blob))
            blob += data + b"\0" * (len(data) % 2)
        else:
            out += data.ljust(4, b"\0")
    out += struct.pack("<I", 0)
    micro = int(round(seconds * 1e6))
    out += struct.pack("<H", 2) + struct.pack("<HHII", 33434, 5, 1, after + len(blob)) + struct.pack("<HHI", 34855, 3, 1)
    out += struct.pack("<HH", 100, 0) + struct.pack("<I", 0)
    out += blob + struct.pack("<II", micro, 1000000)
    assert len(out) == strip
    with open(path, "wb") as f:
        f.write(out + (packed or dn.astype("<u2").tobytes()))


def read_map(path):
    """Y, var.Y and the times of a mosaic's map: uncompressed scan lines."""
    s = open(path, "rb").read()
    p, w, h, times = 8, 0, 0, []
    while s[p] != 0:
        q = s.index(b"\0", p); name = s[p:q]; p = s.index(b"\0", q + 1) + 1
        n, = struct.unpack_from("<i", s, p); p += 4
        if name == b"dataWindow":
            x0, y0, x1, y1 = struct.unpack_from("<4i", s, p)
            w, h = x1 - x0 + 1, y1 - y0 + 1
        if name == b"goniocam:times":
            times = sorted(float(t) for t in s[p:p + n].split())
        p += n
    a = np.frombuffer(s, np.uint8, offset=p + 1 + 8 * h).reshape(h, 8 + w * 8)[:, 8:]
    a = np.ascontiguousarray(a).view("<f4").reshape(h, 2, w).astype(float)
    return a[:, 0], a[:, 1], np.array(times)


class Sensor:
    """DN = clip(round(black + (min(photons, well) + read noise) gain)): electrons, DN an electron."""

    def __init__(self, bits, well, read):
        self.top, self.well, self.read = 2 ** bits - 1, well, read
        self.black = 2 ** (bits - 5)
        self.gain = 0.95 * (self.top - self.black) / well

    def expose(self, random, electrons):
        e = np.minimum(random.poisson(electrons), self.well) + self.read * random.standard_normal(electrons.shape)
        return np.clip(np.rint(self.black + e * self.gain), 0, self.top)

    def bound(self, rate, times):
        """Relative standard deviation of the best estimate; electrons of the longest frame that serves."""
        read2 = self.read ** 2 + 1 / 12 / self.gain ** 2
        information, longest = 0, 0
        for t in times:
            used = rate * t < self.well - 5 * np.sqrt(self.well)
            information = information + np.where(used, t * t / (read2 + rate * t), 0)
            longest = np.where(used, rate * t, longest)
        with np.errstate(divide="ignore"):
            return 1 / np.sqrt(information) / rate, longest


    def best(self, rate, times, frames):
        """The estimate at that bound, from the frames' DN; NAN where all saturate."""
        read2 = self.read ** 2 + 1 / 12 / self.gain ** 2
        above, below = 0, 0
        for t, dn in zip(times, frames):
            used = rate * t < self.well - 5 * np.sqrt(self.well)
            weight = np.where(used, t / (read2 + rate * t), 0)
            above, below = above + weight * (dn - self.black) / self.gain, below + weight * t
        with np.errstate(invalid="ignore"):
            return above / below


def scene(random, low, high):
    """Electrons a second of each photosite: blobs over all decades, a black corner, red and blue weaker."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] / HEIGHT
    a, b, c, d = random.uniform(0, 6, 4)
    wave = 0.25 * (np.sin(3 * x + a) + np.sin(4 * y + b) + np.sin(5 * x - 3 * y + c) + np.sin(2 * x + 4 * y + d))
    rank = np.argsort(np.argsort(wave.ravel())).reshape(wave.shape) / wave.size
    rate = low * (high / low) ** rank
    rate[1::2, 1::2] *= 0.7
    rate[0::2, 0::2] *= 0.5
    return rate


def judge(name, sensor, well_time, wrong, goniocam, seed, unequal=0):
    random = np.random.default_rng(seed)
    response = 1 + unequal * random.standard_normal((HEIGHT, WIDTH))
    stated = np.array([1, 4, 16, 64, 256]) / 256 * well_time
    low, high = 2 / stated[-1], 0.9 * sensor.well / stated[0]  # the brightest do not saturate in the shortest frame
    real = stated * (1 + wrong * random.uniform(-1, 1, 5))
    with tempfile.TemporaryDirectory() as folder:
        rates, best = [], []
        for shot in range(SHOTS):
            rates.append(scene(random, low, high))
            frames = [sensor.expose(random, rates[-1] * response * t) for t in real]
            best.append(sensor.best(rates[-1], real, frames))
            for f in range(5):
                write_dng(os.path.join(folder, "s%d_%d.dng" % (shot, f)), frames[f], stated[f], sensor.top)
        with open(os.path.join(folder, "capture.yaml"), "w") as f:
            f.write("goniocam: 1\nphotos: {pattern: \"s*.dng\"}\n")
            if unequal:
                light = 0.6 * sensor.well * response
                write_dng(os.path.join(folder, "flat.dng"), sensor.expose(random, light), 1, sensor.top)
                f.write("flat: flat.dng\n")
        subprocess.check_call([goniocam, "merge", folder, "-o", folder + "/out", "--quiet"], stdout=subprocess.DEVNULL)
        maps = [read_map("%s/out/radiance/s%d_0.exr" % (folder, k)) for k in range(SHOTS)]
    times = maps[0][2]
    ratio = np.max(np.abs((times[1:] / times[:-1]) / (real[1:] / real[:-1]) - 1))
    channel = np.array([[0, 1], [1, 2]])[np.arange(HEIGHT)[:, None] % 2, np.arange(WIDTH)[None] % 2]
    rate, best = np.stack(rates).ravel(), np.stack(best).ravel()
    value, variance = (np.stack([m[k] for m in maps]).ravel() for k in (0, 1))
    channel = np.stack([channel] * SHOTS).ravel()
    relative, longest = sensor.bound(rate, real)
    relative = np.hypot(relative, unequal)  # all frames share the photosite
    good = np.isfinite(variance) & (longest > 20) & np.isfinite(relative)
    decade = np.floor(np.log10(rate * real[-1] / 20)).astype(int)
    print("%s: times %.3f %%" % (name, 100 * ratio))
    scale = np.ones(3)  # one scale a channel is free: the unit is the full scale that was found
    for c in range(3):
        g = good & (channel == c) & (longest > 1000)
        weight = 1 / relative[g] ** 2
        scale[c] = np.sum(weight * value[g] / rate[g]) / np.sum(weight * best[g] / rate[g])
    error, more = value / (rate * scale[channel]) - 1, (value / scale[channel] - best) / rate
    stated_sigma = np.sqrt(variance, where=good, out=np.ones_like(variance)) / (rate * scale[channel])
    # Where a frame is on the verge of saturation, within 5 standard deviations: whether it serves, noise decides.
    level = rate[:, None] * real[None, 1:] / sensor.well
    verge = np.any((level > 1 - 5 / np.sqrt(sensor.well)) & (level < 1 + 5 / np.sqrt(sensor.well)), axis=1)
    for d in [None, *range(decade[good].min(), decade[good].max() + 1)]:
        worst = [1, 0, 0.683, 0.954]
        count = 0
        for c in range(3):
            g = good & (channel == c) & (verge if d is None else decade == d)
            if g.sum() < (1000 if d is None else 5000):
                continue
            e, z, weight = error[g], np.abs(error[g]) / stated_sigma[g], 1 / relative[g] ** 2
            now = [np.sqrt(np.mean(e ** 2) / np.mean(relative[g] ** 2)),
                   100 * np.average(more[g], weights=weight), np.mean(z < 1), np.mean(z < 2)]
            noise = 100 * np.sqrt(np.sum((weight * more[g]) ** 2)) / np.sum(weight)  # of the bias itself
            if abs(now[1]) >= abs(worst[1]):
                bias_noise = noise
            for k, want in enumerate((1, 0, 0.683, 0.954)):
                if abs(now[k] - want) > abs(worst[k] - want):
                    worst[k] = now[k]
            count += g.sum()
        if count:
            where = "on the verge of saturation" if d is None else "%8.3g to %8.3g electrons in the longest frame" % (
                20 * 10.0 ** d, 20 * 10.0 ** (d + 1))
            print("  %-48s: rms %.4f  bias %+.3f %% (+- %.3f)  1s %.3f  2s %.3f  (%d)"
                  % (where, worst[0], worst[1], bias_noise, worst[2], worst[3], count))


def main():
    goniocam = sys.argv[1]
    for bits, well, read in ((12, 20000, 6), (14, 50000, 3)):
        for wrong in (0, 0.07):
            judge("%d bit, well %d, read noise %d electrons, times off by up to %d %%" % (bits, well, read, 100 * wrong),
                  Sensor(bits, well, read), 1.0, wrong, goniocam, bits + int(1000 * wrong))
    judge("14 bit, well 50000, read noise 3 electrons, photosites unequal by 0.5 % and a flat frame", Sensor(14, 50000, 3), 1.0,
          0.07, goniocam, 5, unequal=0.005)


if __name__ == "__main__":
    main()
