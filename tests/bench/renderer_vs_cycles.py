#!/usr/bin/python3
"""Our renderer against an independent one: rebuilds a shared capture's scene from its truth.json,
renders it, and compares the linear radiance images of both.

    renderer_vs_cycles.py GONIOCAM [CAPTURE] [JUDGE]

CAPTURE is a folder with truth.json and radiance/*.exr (default ../shared/captures/
plastic-sphere-direct beside the repository), JUDGE the folder of the EXR reader capio.py. Prints
rms relative differences in the sample's interior, on white and on black of the tags. Regions are
found in the truth's geometry: points whose neighbourhood of 2.5 px shows nothing else.
"""
import os
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
os.environ["OPENCV_IO_ENABLE_OPENEXR"] = "1"
import cv2
import json
import numpy as np
import yaml

SHARED = os.path.join(os.path.dirname(os.path.realpath(__file__)), "../../../shared")
MARGIN_PX = 2.5


def material(m):
    """The judge's material in the words of our models."""
    if m["type"] == "lambert":
        return {"model": "lambert", "albedo": m["albedo"]}
    if m["type"] == "plastic":
        return {"model": "ggx", "albedo": m["albedo"], "alpha": m["alpha"], "ior": m["ior"]}
    if m["type"] in ("ggx", "beckmann"):
        return {"model": m["type"] + "_schlick", "albedo": [0, 0, 0], "f0": m["color"],
                "alpha": m["alpha"], "edge": 0}
    if m["type"] == "mix":
        k, kind = m["factor"], m.get("distribution", "ggx")
        return {"model": kind + "_schlick", "albedo": [a * (1 - k) for a in m["albedo"]],
                "f0": [c * k for c in m["color"]], "alpha": m["alpha"], "edge": 0}
    raise SystemExit("no model of ours is the judge's '%s'" % m["type"])


def tag(t):
    c = np.array(t["corners"])
    x, y = c[1] - c[0], c[3] - c[0]
    return {"id": t["id"], "size": t["size"], "center": c.mean(0).tolist(),
            "x_axis": (x / np.linalg.norm(x)).tolist(), "y_axis": (y / np.linalg.norm(y)).tolist()}


def patch(p):
    c = np.array(p["corners"])
    x, y = c[1] - c[0], c[3] - c[0]
    return {"center": c.mean(0)[:2].tolist(), "size": [float(np.linalg.norm(x)), float(np.linalg.norm(y))],
            "turn_deg": float(np.degrees(np.arctan2(x[1], x[0]))), "thickness": p["thickness"],
            "albedo": p["albedo"]}


def sample(s):
    out = {"shape": s["kind"], "radius": s["radius"], "center": s["center"],
           "material": material(s["material"])}
    if s["kind"] == "cylinder":
        out.update(axis=s["axis"], height=s["length"])
    return out


def scene(t, shots):
    """SCENE.yaml of a truth.json. The margin of two bits and the sheet 0.1 mm below the paper are
    not in the truth: they were measured in its images."""
    cam, family = t["camera"], t["tags"][0]["family"]
    return {
        "goniocam_scene": 1, "name": t["name"], "seed": t["seed"], "radiance": True,
        "camera": {"size": [cam["width"], cam["height"]], "focal_px": [cam["fx"], cam["fy"]],
                   "center_px": [cam["cx"], cam["cy"]], "distortion": cam["dist"]},
        "exposures": [0.01],
        "lights": [{"position": l["position"], "intensity": l["intensity"]} for l in t["lights"]],
        "sample": sample(t["sample"]), "post": t["post"],
        "board": {"size": t["board"]["size"], "albedo": t["board"]["albedo"], **t["paper"],
                  "family": family, "margin": t["tags"][0]["size"] / 4, "paper_thickness": 0.1,
                  "tags": [tag(a) for a in t["tags"]]},
        "patch": [patch(p) for p in t["white_patches"]],
        "shots": [{"pose": {"rotation": cv2.Rodrigues(np.array(s["R"]))[0].ravel().tolist(),
                            "translation": s["t"], "light": "lamp%d" % s["light"],
                            "power": s["light_jitter"]}} for s in shots],
    }


def regions(t, shot, width, height, common):
    """Masks of pixels well inside the lit sample, and inside white and black of the tags' board."""
    cam = common.Camera(width, height, (t["camera"]["fx"], t["camera"]["fy"]),
                        (t["camera"]["cx"], t["camera"]["cy"]), t["camera"]["dist"])
    g = common.cast_shot(cam, shot["R"], shot["t"], t["sample"], shot["light_position"])
    lit = np.zeros((height, width), np.uint8)
    facing = ((g["normal"] * -0 + g["normal"]) * g["wi"]).sum(-1) > 0.02
    lit[g["v"][facing], g["u"][facing]] = 1
    size = 2 * int(np.ceil(MARGIN_PX)) + 1
    return cv2.erode(lit, np.ones((size, size), np.uint8)) > 0


def flat_board(t, shot, image, common):
    """Pixels whose neighbourhood has the albedo of white, or of black, everywhere; lit only."""
    height, width = image.shape[:2]
    cam = common.Camera(width, height, (t["camera"]["fx"], t["camera"]["fy"]),
                        (t["camera"]["cx"], t["camera"]["cy"]), t["camera"]["dist"])
    u, v = [a.ravel().astype(float) for a in np.meshgrid(np.arange(width), np.arange(height))]
    R, tr = np.array(shot["R"]), np.array(shot["t"])
    d, eye = cam.rays(u, v) @ R, -R.T @ tr
    with np.errstate(all="ignore"):
        p = eye + (-eye[2] / d[:, 2])[:, None] * d
    to = np.array(shot["light_position"]) - p
    r = np.linalg.norm(to, axis=1)
    closed = (np.array(shot["light_intensity"])[0] * (to[:, 2] / r) / r ** 2 / np.pi).reshape(height, width)
    albedo = image[..., 0] / closed
    size = 2 * int(np.ceil(MARGIN_PX)) + 1
    low = cv2.erode(albedo, np.ones((size, size)))
    high = cv2.dilate(albedo, np.ones((size, size)))
    near = [np.abs(low / a - 1) + np.abs(high / a - 1) < 0.01 for a in (t["paper"]["white"], t["paper"]["black"])]
    return closed, near


def rms(a, b):
    return np.sqrt(np.mean((a / b - 1) ** 2)) if a.size else np.nan


def main():
    goniocam = os.path.abspath(sys.argv[1])
    capture = sys.argv[2] if len(sys.argv) > 2 else os.path.join(SHARED, "captures/plastic-sphere-direct")
    sys.path.insert(0, sys.argv[3] if len(sys.argv) > 3 else os.path.join(SHARED, "judge"))
    import capio
    import common
    t = json.load(open(os.path.join(capture, "truth.json")))
    shots = [s for s in t["shots"] if os.path.exists(os.path.join(capture, s["radiance"]))]
    with tempfile.TemporaryDirectory() as work:
        with open(os.path.join(work, "scene.yaml"), "w") as f:
            yaml.safe_dump(scene(t, shots), f)
        subprocess.run([goniocam, "render", os.path.join(work, "scene.yaml"), "-o",
                        os.path.join(work, "out"), "--quiet"], check=True, stdout=subprocess.DEVNULL)
        print("%-8s %12s %12s %12s %12s %12s" % ("shot", "sample", "white", "black", "white~form", "all px rms"))
        for i, s in enumerate(shots):
            other = capio.exr_read(os.path.join(capture, s["radiance"])).astype(float)
            ours = cv2.imread(os.path.join(work, "out/radiance/shot%02d.exr" % i), cv2.IMREAD_UNCHANGED)
            ours = ours[..., :3][..., ::-1].astype(float)
            if os.environ.get("KEEP"):
                np.save(os.environ["KEEP"] + "%02d.npy" % i, np.stack([ours, other]))
            inside = regions(t, s, other.shape[1], other.shape[0], common)
            closed, (white, black) = flat_board(t, s, other, common)
            row = [rms(ours[m], other[m]) for m in (inside, white, black)]
            form = rms(ours[..., 0][white], closed[white] * t["paper"]["white"])
            scale = other[white].mean()
            print("%-8s %12.2e %12.2e %12.2e %12.2e %12.2e" % (
                "shot%02d" % s["index"], *row, form, np.sqrt(np.mean((ours - other) ** 2)) / scale))


main()
