#!/usr/bin/python3
"""RGL files as goniocam writes them, read by the published evaluation (Dupuy and Jakob 2018), in numpy.

Nothing here is shared with the writer: the container, the inversion of the warp and the evaluation are written from
the paper and its supplement. Held against the BRDF's own table: within 1 % in the median and 5 % for 95 % of the bins,
both in rgb and, through the colour matching functions, in the spectral file; and the density by which renderers draw
directions integrates to 1.

    tests/rgl.py GONIOCAM PROJECT [PUBLISHED.json: all SGD materials of it too]
"""
import json
import os
import struct
import subprocess
import sys
import tempfile

import numpy as np

TYPES = {1: "u1", 2: "i1", 3: "<u2", 4: "<i2", 5: "<u4", 6: "<i4", 7: "<u8", 8: "<i8", 9: "<f2", 10: "<f4", 11: "<f8"}
# A plastic with a narrow highlight, chalk, a rough red, gold paint (a metal), and a satin from the published SGD fits.
MATERIALS = {
    "glossy": {"model": "ggx", "parameters": {"albedo": [0.3, 0.2, 0.1], "alpha": 0.05, "ior": 1.5}},
    "matt": {"model": "lambert", "parameters": {"albedo": [0.6, 0.5, 0.4]}},
    "rough": {"model": "ggx", "parameters": {"albedo": [0.5, 0.1, 0.1], "alpha": 0.4, "ior": 1.4}},
    "metal": {"model": "ggx_schlick", "parameters": {"albedo": [0, 0, 0], "f0": [0.9, 0.7, 0.4], "alpha": 0.15, "edge": 1}},
}
SGD = {"rhoD": [0.0478786, 0.0313514, 0.0200638], "rhoS": [0.0364976, 0.664975, 0.268836],
       "alpha": [0.014832, 0.0300126, 0.0490339], "p": [0.459076, 0.450056, 0.529272],
       "F0": [0.6, 0.235756, 0.580647], "F1": [0.3, 0.182842, 0.476088], "lambda": [2.60672, 2.97371, 2.7827],
       "c": [1.12717e-07, 1.06401e-07, 5.27952e-08], "k": [47.783, 36.2767, 31.6066],
       "theta0": [0.205635, 0.066289, -0.0661091]}
MATERIALS["bronze"] = {"model": "sgd", "parameters": SGD}


def read_tensors(path):
    data = open(path, "rb").read()
    assert data[:12] == b"tensor_file\0" and data[12:14] == b"\1\0", "%s: no tensor file" % path
    count, = struct.unpack_from("<I", data, 14)
    at, fields = 18, {}
    for _ in range(count):
        length, = struct.unpack_from("<H", data, at)
        name = data[at + 2:at + 2 + length].decode()
        dims, kind, offset = struct.unpack_from("<HBQ", data, at + 2 + length)
        shape = struct.unpack_from("<%dQ" % dims, data, at + 13 + length)
        at += 13 + length + 8 * dims
        assert offset % 8 == 0 and offset >= at - 8 * dims
        fields[name] = np.frombuffer(data, TYPES[kind], int(np.prod(shape)), offset).reshape(shape).astype(float)
    return fields


def patches(x, n):
    place = np.clip(x, 0, 1) * (n - 1)
    low = np.minimum(place.astype(int), n - 2)
    return low, place - low


def corners(grid, row, col):
    """grid [T, H, W], or [T, C, H, W]; a generator over slices is not needed: row and col index the last axes."""
    return grid[..., row, col], grid[..., row, col + 1], grid[..., row + 1, col], grid[..., row + 1, col + 1]


def bilinear(grid, x, y):
    """A function [H, W] at x along the fast axis, y along the slow one."""
    (col, fx), (row, fy) = patches(x, grid.shape[-1]), patches(y, grid.shape[-2])
    a, b, c, d = corners(grid, row, col)
    return (a * (1 - fx) + b * fx) * (1 - fy) + (c * (1 - fx) + d * fx) * fy


class Density:
    """Bilinear densities [T, H, W] on the unit square, one a slice, each made to integrate to 1."""

    def __init__(self, values):
        row_of = lambda v: np.concatenate([np.zeros_like(v[..., :1]), np.cumsum((v[..., 1:] + v[..., :-1]) / 2, -1)], -1)
        conditional = row_of(values)
        marginal = row_of(conditional[..., -1])
        total = marginal[:, -1]
        self.cells = (values.shape[-1] - 1) * (values.shape[-2] - 1)
        self.values = values / total[:, None, None]
        self.conditional, self.marginal = conditional / total[:, None, None], marginal / total[:, None]

    def pick(self, array, slices, *index):
        """Values of both slices, blended."""
        low, share = slices
        return array[(low,) + index] * (1 - share) + array[(low + 1,) + index] * share

    def invert(self, slices, x, y):
        (col, fx), (row, fy) = patches(x, self.values.shape[-1]), patches(y, self.values.shape[-2])
        v = lambda i, j: self.pick(self.values, slices, row + i, col + j)
        left, right = v(0, 0) * (1 - fy) + v(1, 0) * fy, v(0, 1) * (1 - fy) + v(1, 1) * fy
        cdf = lambda i, c: self.pick(self.conditional, slices, row + i, c)
        last = np.full_like(row, self.values.shape[-1] - 1)
        before = cdf(0, col) * (1 - fy) + cdf(1, col) * fy
        r0, r1 = cdf(0, last), cdf(1, last)
        sx = (before + fx * left + 0.5 * fx ** 2 * (right - left)) / (r0 * (1 - fy) + r1 * fy)
        sy = self.pick(self.marginal, slices, row) + fy * r0 + 0.5 * fy ** 2 * (r1 - r0)
        return sx, sy, (left * (1 - fx) + right * fx) * self.cells


class Material:
    def __init__(self, path):
        self.f = read_tensors(path)
        assert len(self.f["phi_i"]) <= 2, "not isotropic"
        self.vndf, self.luminance = Density(self.f["vndf"][0]), Density(self.f["luminance"][0])
        self.color = self.f["rgb" if "rgb" in self.f else "spectra"][0]  # [T, channels, h, w]

    def slices(self, theta):
        nodes = self.f["theta_i"]
        low = np.clip(np.searchsorted(nodes, theta, "right") - 1, 0, len(nodes) - 2)
        return low, np.clip((theta - nodes[low]) / (nodes[low + 1] - nodes[low]), 0, 1)

    def coordinates(self, wi, wo):
        m = wi + wo
        m /= np.linalg.norm(m, axis=-1, keepdims=True)
        theta = lambda w: np.arctan2(np.hypot(w[..., 0], w[..., 1]), w[..., 2])
        phi = lambda w: np.arctan2(w[..., 1], w[..., 0])
        u = lambda t: np.sqrt(t * 2 / np.pi)
        v = lambda p: (p + np.pi) / (2 * np.pi)
        um_y = v(phi(m) - phi(wi))
        return m, theta(wi), theta(m), (u(theta(wi)), v(phi(wi))), (u(theta(m)), um_y - np.floor(um_y))

    def eval(self, wi, wo):
        """f, [N, channels]."""
        m, theta_i, theta_m, ui, um = self.coordinates(wi, wo)
        low, share = self.slices(theta_i)
        sx, sy, _ = self.vndf.invert((low, share), *um)
        (col, fx), (row, fy) = patches(sx, self.color.shape[-1]), patches(sy, self.color.shape[-2])
        value = 0
        for t, w in ((low, 1 - share), (low + 1, share)):
            for i, wy in ((0, 1 - fy), (1, fy)):
                for j, wx in ((0, 1 - fx), (1, fx)):
                    value = value + (w * wy * wx)[:, None] * self.color[t, :, row + i, col + j]
        scale = bilinear(self.f["ndf"], *um) / (4 * bilinear(self.f["sigma"], *ui))
        return value * (scale / wo[..., 2])[:, None]

    def pdf(self, wi, wo):
        m, theta_i, theta_m, ui, um = self.coordinates(wi, wo)
        slices = self.slices(theta_i)
        sx, sy, visible = self.vndf.invert(slices, *um)
        _, _, light = self.luminance.invert(slices, sx, sy)
        jacobian = np.maximum(2 * np.pi ** 2 * um[0] * np.sin(theta_m), 1e-6) * 4 * np.sum(wi * m, -1)
        return visible * light / jacobian


def bin_directions(index):
    """Middles of MERL's bins -> wi, wo, and whether both are above the horizon."""
    th = ((index // 16200 + 0.5) / 90) ** 2 * np.pi / 2
    td, pd = (index // 180 % 90 + 0.5) / 90 * np.pi / 2, (index % 180 + 0.5) / 180 * np.pi
    d = np.stack([np.sin(td) * np.cos(pd), np.sin(td) * np.sin(pd), np.cos(td)], -1)
    turn = lambda d: np.stack([np.cos(th) * d[:, 0] + np.sin(th) * d[:, 2], d[:, 1],
                               -np.sin(th) * d[:, 0] + np.cos(th) * d[:, 2]], -1)
    return turn(d), turn(d * [-1, -1, 1])


def read_merl(path):
    data = np.fromfile(path, "<f8", offset=12).reshape(3, -1)
    return data.T * (np.array([1.0, 1.15, 1.66]) / 1500)


# The CIE 1931 observer in the fit of Wyman, Sloan and Shirley (JCGT 2013), and D65 every 10 nm (CIE 15).
D65 = np.array([49.9755, 54.6482, 82.7549, 91.486, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923, 108.811,
                109.354, 107.802, 104.79, 107.689, 104.405, 104.046, 100, 96.3342, 95.788, 88.6856, 90.0062, 89.5991,
                87.6987, 83.2886, 83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.349, 61.604, 69.8856,
                75.087, 63.5927, 46.4182, 66.8054, 63.3828])


def spectra_to_rgb(wavelengths, spectra):
    nm = np.arange(380, 781, 10.0)
    g = lambda m, a, b: np.exp(-0.5 * ((nm - m) * np.where(nm < m, a, b)) ** 2)
    xyz = np.stack([1.056 * g(599.8, 0.0264, 0.0323) + 0.362 * g(442.0, 0.0624, 0.0374) - 0.065 * g(501.1, 0.0490, 0.0382),
                    0.821 * g(568.8, 0.0213, 0.0247) + 0.286 * g(530.9, 0.0613, 0.0322),
                    1.217 * g(437.0, 0.0845, 0.0278) + 0.681 * g(459.0, 0.0385, 0.0725)])
    rgb = np.linalg.solve([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
                           [0.0193339, 0.1191920, 0.9503041]], xyz) * D65
    rgb /= rgb.sum(1, keepdims=True)
    return np.array([np.interp(nm, wavelengths, s) for s in spectra]) @ rgb.T


def check_density(material):
    """Integrals over the hemisphere: what is drawn below the horizon is missing, nothing is there twice."""
    n = 600
    u, v = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) / n)
    theta, phi = u.ravel() ** 2 * np.pi / 2, v.ravel() * 2 * np.pi
    area = np.pi * u.ravel() * np.sin(theta) * 2 * np.pi / n ** 2
    m = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    for degrees in (0, 40, 70):
        wi = np.array([np.sin(np.radians(degrees)), 0, np.cos(np.radians(degrees))])
        c = m @ wi
        wo = 2 * c[:, None] * m - wi
        pdf = np.where(c > 0.02, material.pdf(np.broadcast_to(wi, wo.shape), wo), 0)
        total = np.sum(pdf * 4 * np.abs(c) * area)  # over wo, of all half vectors
        assert 0.97 < total < 1.01, "the density at %d degrees integrates to %g" % (degrees, total)


def main():
    goniocam = sys.argv[1]
    materials = dict(MATERIALS)
    failed = False
    with tempfile.TemporaryDirectory() as work:
        sources = {}
        for name, what in materials.items():
            sources[name] = os.path.join(work, name + ".json")
            json.dump(what, open(sources[name], "w"))
        for name in ("glossy", "bronze"):  # tables, which have a kink at every bin's middle
            table = os.path.join(work, name + ".binary")
            subprocess.check_call([goniocam, "export", sources[name], "--to", "merl", "-o", table, "--quiet"])
            sources[name + "'s table"] = table
        for published in sys.argv[3:]:
            sources.update({n: "%s#sgd/%s" % (published, n) for n in json.load(open(published))["sgd"]})
        for name, source in sources.items():
            base, table = os.path.join(work, "x"), os.path.join(work, "x.binary")
            for to, out in (("rgl", base), ("merl", table)):
                subprocess.check_call([goniocam, "export", source, "--to", to, "-o", out, "--quiet"])
            truth = read_merl(table)
            known = np.flatnonzero(truth[:, 0] >= 0)
            index = np.random.default_rng(7).choice(known, 20000, replace=False)
            wi, wo = bin_directions(index)
            rgb, spectral = Material(base + "_rgb.bsdf"), Material(base + "_spec.bsdf")
            want = truth[index]
            got = {"rgb": rgb.eval(wi, wo),
                   "spectral": spectra_to_rgb(spectral.f["wavelengths"], spectral.eval(wi, wo)[:5000])}
            for kind, value in got.items():
                e = np.abs(value - want[:len(value)]) / np.maximum(want[:len(value)], 1e-9)
                median, most = np.median(e), np.quantile(e, 0.95)
                good = median <= 0.01 and most <= 0.05
                failed |= not good
                print("%-24s %-9s median %.3f %%, 95 %% %.2f %%%s" % (name, kind, 100 * median, 100 * most,
                                                                    "" if good else "  FAILED"))
            assert np.all(rgb.f["luminance"] > 0) and np.all(rgb.f["vndf"] >= 0) and np.all(rgb.f["ndf"] > 0)
            check_density(rgb)
    sys.exit(failed)


if __name__ == "__main__":
    main()
