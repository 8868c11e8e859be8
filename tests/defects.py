#!/usr/bin/python3
"""Hot, dead and stuck photosites, found in photographs of a moving scene without dark or flat frames; and how unequal the
others are.

    tests/defects.py GONIOCAM PROJECT

The same photographs are rendered with and without leaks: where their numbers differ, a photosite leaks. Dead and stuck ones
are put into the files.
"""
import glob
import os
import struct
import subprocess
import sys
import tempfile

import cv2
import numpy as np
import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
sys.path.insert(1, os.path.join(sys.path[0], "bench"))
import limits
from limits import check
from merge_error import read_map as read_rgb

WIDTH, HEIGHT, BLACK, WHITE = 640, 430, 512, 14000


def mosaic(path):
    """A DNG of one strip, as a map of its file: what is written there is in the file."""
    data = np.memmap(path, np.uint8, "r+")
    directory, = struct.unpack_from("<I", data, 4)
    for k in range(struct.unpack_from("<H", data, directory)[0]):
        tag, _, _, value = struct.unpack_from("<HHII", data, directory + 2 + 12 * k)
        if tag == 273:
            return data[value:value + 2 * WIDTH * HEIGHT].view("<u2").reshape(HEIGHT, WIDTH)
    raise ValueError(path)


def read_map(path):
    """Y and var.Y of a mosaic's map."""
    s = open(path, "rb").read()
    p = 8
    while s[p] != 0:
        p = s.index(b"\0", s.index(b"\0", p) + 1) + 1
        p += 4 + struct.unpack_from("<i", s, p)[0]
    a = np.frombuffer(s, np.uint8, offset=p + 1 + 8 * HEIGHT).reshape(HEIGHT, 8 + WIDTH * 8)[:, 8:]
    a = np.ascontiguousarray(a).view("<f4").reshape(HEIGHT, 2, WIDTH).astype(float)
    return a[:, 0], a[:, 1]


def maps(folder):
    return [read_map(p) for p in sorted(glob.glob(folder + "/radiance/*.exr"))]


def marked(folder):
    return np.all([np.isinf(variance) for _, variance in maps(folder)], axis=0)


def one_view(folder, run, random, unequal):
    """A single shot of smooth light; -> the relative scatter beyond noise that each channel's variance holds, and the
    stated standard deviation over the true one of noise alone, where it is bright."""
    width, height, black, white, times = 1200, 800, 512, 16383, 4.0 ** np.arange(4) / 4096  # 1 electron a DN, 5 of noise
    y, x = np.mgrid[0:height, 0:width]
    rate = (1e7 * 10 ** (-2 * x / width) * (1 - 0.3 * y / height))[..., None] * np.ones(3)
    lit = rate * (1 + unequal * random.standard_normal(rate.shape))
    information = 0
    os.makedirs(folder)
    with open(os.path.join(folder, "capture.yaml"), "w") as f:
        f.write('goniocam: 1\nphotos: {pattern: "*.tif"}\noverrides:\n')
        for k, t in enumerate(times):
            f.write('- {photos: "a_%d.tif", exposure_time: "%.10f"}\n' % (k, t))
    for k, t in enumerate(times):
        e = lit * t + np.sqrt(lit * t + 25) * random.standard_normal(rate.shape)
        cv2.imwrite(os.path.join(folder, "a_%d.tif" % k), np.clip(np.rint(black + e), 0, white).astype(np.uint16))
        below = rate * t < white - black - 6 * np.sqrt(rate * t + 25)
        information = information + below * t * t / (rate * t + 25 + 1 / 12)
    run("merge", folder, "-o", folder + "-out")
    value, variance = read_rgb(folder + "-out/radiance/a_0.exr")
    bright, noise = np.s_[:, 100:400], 1 / information / (white - black) ** 2
    more = np.median(((variance - noise) / value ** 2)[bright], axis=(0, 1))
    return np.sqrt(np.maximum(more, 0)), np.sqrt(np.median((variance / noise)[bright], axis=(0, 1)))


def main():
    goniocam, project = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        at = lambda n: os.path.join(folder, n)
        run = lambda *a: subprocess.run([goniocam, *a], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                        text=True).stderr
        with open(os.path.join(project, "samples/tiny.yaml")) as f:
            scene = yaml.safe_load(f)
        scene["files"] = "dng"
        scene["sample"]["material"]["alpha"] = 0.05  # small highlights, which are no defects

        def render(name, **blemishes):
            scene["sensor"] = dict({"mosaic": "rggb", "electrons": 3e7, "dn_per_electron": 0.3, "full_well": 45000,
                                    "read_noise": 3, "black_level": BLACK, "adc_max": WHITE,
                                    "channel_gain": [0.55, 1, 0.7]}, **blemishes)
            with open(at(name + ".yaml"), "w") as f:
                yaml.safe_dump(scene, f)
            run("render", at(name + ".yaml"), "-o", at(name), "--quiet")
            return np.array([mosaic(p) for p in sorted(glob.glob(at(name) + "/*_exp2.dng"))], float)

        sound, leaky = render("sound"), render("leaky", hot_fraction=1e-3, hot_rate=2e5)
        hot = np.any(leaky != sound, axis=0)
        # What shows in a view: a leak or a lack of 7 standard deviations, unsaturated.
        signal = np.maximum(sound - BLACK, 0)
        sigma = np.sqrt(1 + 0.3 * signal + (0.01 * signal) ** 2)
        unsaturated = sound < 0.9 * WHITE
        strong = np.sum((leaky - sound > 7 * sigma) & unsaturated, axis=0) >= 4
        lit = (np.sum((signal > 7 * sigma) & unsaturated, axis=0) >= 4) & ~hot
        for side in (strong, lit):
            side[:4], side[-4:], side[:, :4], side[:, -4:] = 0, 0, 0, 0
        random = np.random.default_rng(1)
        places = random.choice(np.flatnonzero(lit), 60, replace=False)
        dead, stuck = places[:40], places[40:]
        for path in glob.glob(at("leaky") + "/*.dng"):
            dn = mosaic(path).reshape(-1)
            dn[dead] = BLACK + (dn[dead] - BLACK) // 20
            dn[stuck] = WHITE
            dn.base.flush()
        told = run("merge", at("leaky"), "-o", at("leaky-out"))
        found = marked(at("leaky-out")).reshape(-1)
        bad = hot.reshape(-1).copy()
        bad[places] = True
        strong = strong.reshape(-1) & ~np.isin(np.arange(bad.size), places)
        check("hot ones that show in 4 of 6 views: share found", found[strong].mean(), 0.85, 1)
        check("  of so many", strong.sum(), 50, 1000)
        check("dead ones in 4 of 6 views' light: share found", found[dead].mean(), 0.7, 1)
        check("stuck ones: share found", found[stuck].mean(), 0.95, 1)
        check("sound ones taken for defective", np.sum(found & ~bad), 0, 0)
        check("told", "hot and" in told, 1, 1)

        run("merge", at("sound"), "-o", at("sound-out"))
        alike = [(v, s) for v, s in maps(at("sound-out"))]
        check("of a sensor without defects, taken", np.sum(marked(at("sound-out"))), 0, 0)
        # A camera that stands still: what stands out in all shots may as well be the scene.
        for path in glob.glob(at("leaky") + "/shot0[1-9]*"):
            os.remove(path)
        for k in range(1, 5):
            for path in glob.glob(at("leaky") + "/shot00*"):
                with open(path, "rb") as f, open(path.replace("shot00", "shot%02d" % k), "wb") as g:
                    g.write(f.read())
        told = run("merge", at("leaky"), "-o", at("still-out"))
        check("where nothing moves, taken", "hot and" in told, 0, 0)

        # Unequal photosites: the variance says so, and truly.
        for unequal, low, high in ((0.006, 0.0054, 0.0066), (0, 0, 0.0012)):
            render("unequal%g" % unequal, prnu=unequal)
            run("merge", at("unequal%g" % unequal), "-o", at("unequal%g-out" % unequal))
            excess = []
            for (v, s), (_, s0) in zip(maps(at("unequal%g-out" % unequal)), alike):
                bright = np.isfinite(s) & np.isfinite(s0) & (v > np.quantile(v, 0.9))
                excess.append(np.median((s[bright] - s0[bright]) / v[bright] ** 2))
            check("photosites unequal by %g %%: in the variance, %%" % (100 * unequal), 100 * max(np.mean(excess), 0) ** 0.5,
                  100 * low, 100 * high)
        # Of one view, what noise does not explain: 4 sigma of that, and of the noise itself, which is good to 0.35 %.
        random = np.random.default_rng(3)
        found = one_view(at("one"), run, random, 0.004)[0]
        check("one view, unequal by 0.4 %: least in the variance, %", 100 * found.min(), 0.35, 0.45)
        check("  most, %", 100 * found.max(), 0.35, 0.45)
        stated = one_view(at("one0"), run, random, 0)[1]
        check("one view, not unequal: least stated over true sigma", stated.min(), 1 - 4 * 0.0035, 1.01)
        check("  most", stated.max(), 0.99, 1 + 4 * 0.0035)
    sys.exit(1 if limits.failed else 0)


if __name__ == "__main__":
    main()
