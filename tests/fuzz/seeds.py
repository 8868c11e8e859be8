#!/usr/bin/python3
"""Seeds for the fuzz targets: small files of every kind, from a capture of a few pixels.

    tests/fuzz/seeds.py GONIOCAM FOLDER
"""
import os
import shutil
import struct
import subprocess
import sys
import tempfile

SCENE = """goniocam_scene: 1
name: seed
camera: {size: [48, 32], focal_length: 50, sensor_width: 25}
exposures: [0.01, 0.04]
lights: [{name: lamp, azimuth_deg: 270, elevation_deg: 40, distance: 600, intensity: 1.0e+5}]
sample: {shape: sphere, radius: 25, center: [0, 0, 45], material: {model: lambert, albedo: [0.3, 0.3, 0.3]}}
board: {size: [250, 190], margin: 6, tags: {ring: {columns: 3, rows: 2, size: 40, pitch: 60}}}
patch: {center: [56, 2], size: 32}
shots:
- look: {eye: [330, -390, 420], target: [0, 0, 20]}
"""
CALIBRATION = """cameras:
- {name: c, width: 48, height: 32, focal: [100, 100], center: [24, 16], distortion: [0, 0, 0, 0, 0], rms_px: 0.1}
lights:
- {name: l, frame: world, position: [0, -500, 300], intensity: [1, 1, 1]}
shots:
- {name: s, camera: c, light: l, rotation: [2, 0, 0], translation: [0, 0, 600], power: 1, rms_px: 0.1,
   tags: [{id: 0, corners: [[1, 2], [3, 2], [3, 0], [1, 0]]}]}
sample: {shape: sphere, center: [0, 0, 45], radius: 25}
"""


BRDFS = {
    "samples.txt": b"30 30 180 0.5 0.6 0.7\n0 60 0 0.1 0.1 0.1\n",
    "named.csv": b"theta_h,theta_d,phi_d,r,g,b\n1,2,3,0.1,0.2,0.3\n",
    "cornell.brdf": b"3\n450 550 650 # nm\n0.5 0 0.5 3.1 0.5 0.5 0.5\n",
    "model.json": b'{"model": "ggx", "parameters": {"albedo": [0.1, 0.2, 0.3], "alpha": 0.1, "ior": 1.5}}',
    "fits.yaml": b"models:\n- {name: lambert, parameters: {albedo: {value: [0.1, 0.2, 0.3]}}}\n",
    "mit.bin": struct.pack("<16i", 2, 2, 3, 2, 0, 0, 1, 0, 0, 1, 3, 0, 0, 0, 0, 0) + struct.pack("<72f", *[0.5] * 72),
}


def tensor_file(fields):
    """An RGL file of float32 fields {name: (shape, values)}, and the flag `jacobian`."""
    entries = [(n, 10, shape, struct.pack("<%df" % len(v), *v)) for n, (shape, v) in fields.items()]
    entries.append(("jacobian", 1, (1,), b"\1"))
    offset = 18 + sum(13 + len(n) + 8 * len(shape) for n, _, shape, _ in entries)
    head, body = b"tensor_file\0\1\0" + struct.pack("<I", len(entries)), b""
    for name, kind, shape, data in entries:
        body += b"\0" * (-(offset + len(body)) % 8)
        head += struct.pack("<H", len(name)) + name.encode()
        head += struct.pack("<HBQ%dQ" % len(shape), len(shape), kind, offset + len(body), *shape)
        body += data
    return head + body


def main():
    goniocam, folder = sys.argv[1:3]
    place = {n: os.path.join(folder, n) for n in ("photo", "capture_yaml", "exr", "merl", "calibration", "brdf")}
    for p in place.values():
        os.makedirs(p, exist_ok=True)
    for name, data in BRDFS.items():
        open(os.path.join(place["brdf"], name), "wb").write(data)
    small = {"phi_i": ((1,), [0]), "theta_i": ((2,), [0, 1.5]), "ndf": ((2, 2), [1] * 4), "sigma": ((2, 2), [1] * 4),
             "vndf": ((1, 2, 2, 2), [1] * 8), "luminance": ((1, 2, 2, 2), [1] * 8)}
    rgb = {"rgb": ((1, 2, 3, 2, 2), [0.5] * 24)}
    spectral = {"wavelengths": ((2,), [450, 600]), "spectra": ((1, 2, 2, 2, 2), [0.5] * 16)}
    for name, more in (("rgb.bsdf", rgb), ("spec.bsdf", spectral)):
        open(os.path.join(place["brdf"], name), "wb").write(tensor_file({**small, **more}))
    with tempfile.TemporaryDirectory() as work:
        scene, capture = os.path.join(work, "scene.yaml"), os.path.join(work, "capture")
        open(scene, "w").write(SCENE)
        subprocess.check_call([goniocam, "render", scene, "-o", capture, "--quiet"], stdout=subprocess.DEVNULL)
        for name in os.listdir(capture):
            if name.endswith(".tif"):
                shutil.copy(os.path.join(capture, name), place["photo"])
        shutil.copy(os.path.join(capture, "capture.yaml"), place["capture_yaml"])
        subprocess.check_call([goniocam, "merge", capture, "-o", work, "--quiet"], stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL)
        for name in os.listdir(os.path.join(work, "radiance")):
            shutil.copy(os.path.join(work, "radiance", name), place["exr"])
    import cv2
    import numpy as np
    image = np.arange(48 * 32 * 3, dtype=np.uint8).reshape(32, 48, 3)
    cv2.imwrite(os.path.join(place["photo"], "a.jpg"), image)
    cv2.imwrite(os.path.join(place["photo"], "a.png"), image)
    open(os.path.join(place["calibration"], "a.yaml"), "w").write(CALIBRATION)
    open(os.path.join(place["merl"], "a.binary"), "wb").write(struct.pack("<3i", 90, 90, 180) + bytes(800))


if __name__ == "__main__":
    main()
