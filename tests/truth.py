"""What the tests compare with: truth.json of a rendered capture, and the closed form of its material.

Written from ../shared/design.md and formulas.md, apart from the program: the tests must not inherit its errors.
"""
import json

import h5py
import numpy as np
import yaml


def ggx(material, wi, wo):
    """Lambert + dielectric GGX, f [n][3], of unit directions [n][3] in the local frame (normal = z)."""
    albedo, alpha, n = np.asarray(material["albedo"], float), material["alpha"], material["ior"]
    h = wi + wo
    h /= np.linalg.norm(h, axis=-1, keepdims=True)
    c, ci, co, ch = (wi * h).sum(-1), wi[..., 2], wo[..., 2], h[..., 2]
    g = np.sqrt(n * n - 1 + c * c)
    fresnel = 0.5 * ((g - c) / (g + c)) ** 2 * (1 + ((c * (g + c) - 1) / (c * (g - c) + 1)) ** 2)
    d = alpha ** 2 / (np.pi * (ch ** 2 * (alpha ** 2 - 1) + 1) ** 2)

    def g1(x):
        return 2 / (1 + np.sqrt(1 + alpha ** 2 * (1 / x ** 2 - 1)))

    return albedo / np.pi + (fresnel * d * g1(ci) * g1(co) / (4 * ci * co))[..., None]


def directions(angles):
    """theta_h, theta_d, phi_d [n][3] -> wi, wo [n][3] with the azimuth of h at 0."""
    th, td, pd = np.moveaxis(np.asarray(angles, float), -1, 0)
    d = np.stack([np.sin(td) * np.cos(pd), np.sin(td) * np.sin(pd), np.cos(td)], -1)
    c, s = np.cos(th), np.sin(th)

    def up(v):
        return np.stack([c * v[..., 0] + s * v[..., 2], v[..., 1], c * v[..., 2] - s * v[..., 0]], -1)

    return up(d), up(d * [-1, -1, 1])


def albedo(material, theta_i_deg):
    """Directional albedo [3] of ggx(), by the midpoint rule in cos^2 and azimuth."""
    n = 600
    u, phi = (np.arange(n) + 0.5) / n, np.pi * (np.arange(n) + 0.5) / n
    z, phi = np.meshgrid(np.sqrt(u), phi, indexing="ij")
    r = np.sqrt(1 - z * z)
    wo = np.stack([r * np.cos(phi), r * np.sin(phi), z], -1)
    t = np.radians(theta_i_deg)
    return np.pi * ggx(material, np.array([np.sin(t), 0, np.cos(t)]), wo).mean((0, 1))


class Truth:
    def __init__(self, path):
        with open(path) as f:
            self.t = json.load(f)
        self.material = self.t["sample"]["material"]

    def bins(self, out, limit_deg=75):
        """Errors of measured bins to limit_deg: relative errors [n][3], z-scores [n][3]."""
        with h5py.File(out + "/bins.h5") as f:
            seen = f["status"][...] == 1
            mean, stderr, angles = (f[k][...][seen] for k in ("mean", "stderr", "centroid"))
        wi, wo = directions(angles)
        good = np.minimum(wi[:, 2], wo[:, 2]) > np.cos(np.radians(limit_deg))
        f = ggx(self.material, wi[good], wo[good])
        return (mean[good] - f) / f, (mean[good] - f) / stderr[good]


def load(path):
    with open(path) as f:
        return yaml.safe_load(f)
