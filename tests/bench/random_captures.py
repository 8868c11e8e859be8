#!/usr/bin/python3
"""Captures drawn at random in everything at once: what does a stranger's capture come back with?

    tests/bench/random_captures.py [--goniocam build/release/goniocam] [--keep FOLDER] [FIRST [LAST]]

Scene number n (seeds FIRST to LAST, default 1 to 20) has its own camera, lens and size of photographs, board and family
of tags, lamps (of any place, size, number and power, or on the camera), sample (shape, size, place, material), exposures,
files and, of three, one a board that throws light back. Each is rendered, reconstructed and held against its truth by
tests/bench/scenes.py, whose columns are printed, after a line that tells what the scene is. Warnings are shown: the
scenes give cause to none, but to those that name a lit board or too few photographs.
"""
import argparse
import os
import random
import sys
import tempfile

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(TOP, "tests/bench"))
import scenes as S


def color(r, low, high):
    return [round(r.uniform(low, high), 3) for _ in range(3)]


def material(r):
    alpha = round(10 ** r.uniform(-1.3, -0.3), 3)
    kind = r.choice(["plastic", "plastic", "metal", "matt", "coarse", "paint"])
    if kind == "plastic":
        return {"model": r.choice(["ggx", "beckmann"]), "albedo": color(r, 0.02, 0.6), "alpha": alpha,
                "ior": round(r.uniform(1.35, 1.8), 2)}
    if kind == "metal":
        return {"model": "ggx_conductor", "eta": color(r, 0.2, 2.5), "k": color(r, 2, 5), "alpha": max(alpha, 0.08)}
    if kind == "matt":
        return {"model": "lambert", "albedo": color(r, 0.03, 0.8)}
    if kind == "coarse":
        return {"model": "oren_nayar", "albedo": color(r, 0.05, 0.8), "sigma": round(r.uniform(0.1, 0.6), 2)}
    return {"model": "disney", "base": color(r, 0.03, 0.5), "metallic": round(r.uniform(0, 0.6), 2),
            "roughness": round(r.uniform(0.3, 0.8), 2), "specular": 0.5, "specular_tint": 0, "sheen": r.choice([0, 0.5]),
            "sheen_tint": 0.5, "subsurface": 0, "clearcoat": r.choice([0, 1]), "clearcoat_gloss": 0.5}


def sample(r, board):
    shape = r.choice(["sphere", "sphere", "sphere", "cylinder", "mesh"])
    size = board * r.uniform(0.06, 0.13)
    place = [r.uniform(-2, 2), r.uniform(-2, 2)]
    off = [r.gauss(0, 0.6) for _ in range(3)]
    if shape == "sphere":
        center = place + [size * r.uniform(1.3, 2.2)]
        return {"shape": "sphere", "radius": round(size, 2), "center": center,
                "nominal_center": [c + o for c, o in zip(center, off)]}
    if shape == "cylinder":
        turn = r.uniform(-0.4, 0.4)
        center = place + [size * r.uniform(1.8, 2.6)]
        return {"shape": "cylinder", "radius": round(0.7 * size, 2), "height": round(2.8 * size, 1), "axis": [1, turn, 0],
                "center": center, "nominal_center": [c + o for c, o in zip(center, off)]}
    return {"shape": "mesh", "file": "vase.ply", "scale": round(size / 26, 3), "rotation_deg": [4, -3, r.uniform(0, 90)],
            "center": [0, 0, 1.9 * size]}


def lamps(r, board, height):
    def one(name):
        if r.random() < 0.2:
            return {"name": name, "on_camera": True, "position": [r.uniform(-0.4, 0.4) * board, -r.uniform(0.2, 0.5) * board,
                                                                  r.uniform(-20, 20)]}
        return {"name": name, "azimuth_deg": r.uniform(200, 340), "elevation_deg": r.uniform(15, 70),
                "distance": board * r.uniform(1.6, 4), "radius": r.choice([0, 0, 4, 10]) * board / 250}
    many = r.choice([1, 1, 1, 2, 3])
    made = [one("lamp%d" % i) for i in range(many)]
    for light in made:
        light["intensity"] = round(1e5 * ((light.get("distance", 2.4 * board)) / 600) ** 2 * r.uniform(0.5, 1.5))
    return made


def scene(seed):
    r = random.Random(seed)
    size = r.choice([[640, 430], [900, 600], [600, 800], [1200, 800]])
    width = r.choice([6.2, 13.2, 17.3, 23.5, 36])  # of phones to 135 film
    zoom = r.uniform(0.9, 4.5)  # focal length over the sensor's width: 60 to 12 degrees
    board = r.choice([180, 250, 400, 800])
    tags = board * 0.12
    s = {"goniocam_scene": 1, "name": "random-%d" % seed, "seed": seed}
    diagonal = -0.28 if zoom < 1.2 else r.uniform(-0.12, 0.04)
    s["camera"] = {"size": size, "sensor_width": width, "focal_length": round(zoom * width, 1),
                   "center_px": [size[0] / 2 + r.uniform(-12, 12), size[1] / 2 + r.uniform(-12, 12)],
                   "distortion": [diagonal, r.uniform(-0.05, 0.1), r.uniform(-6e-4, 6e-4), r.uniform(-6e-4, 6e-4), 0],
                   "blur_px": r.choice([0, 0.4, 0.7]), "vignetting": r.choice([[0, 0, 0], [-0.1, -0.05, 0]])}
    s["flat"] = s["camera"]["vignetting"][0] != 0 and r.random() < 0.7
    s["exposures"] = [4.0 ** -k for k in range(4, 4 - r.choice([3, 4, 5]), -1)]
    family = r.choice(["tag36h11", "tag36h11", "tag25h9", "tagStandard41h12"])
    if family == "tagStandard41h12":  # bits stand outside of its square, too
        tags *= 0.6
    s["board"] = {"size": [board, 0.76 * board], "family": family,
                  "tags": {"ring": {"columns": 5, "rows": 4, "size": tags, "pitch": 0.184 * board}},
                  "albedo": r.choice([0.05, 0.2, 0.5]), "white": r.uniform(0.7, 0.9), "black": r.uniform(0.03, 0.06)}
    s["patch"] = {"center": [0.224 * board, 0.01 * board], "size": 0.128 * board, "albedo": r.choice([0.9, 0.99])}
    s["sample"] = dict(sample(r, board), material=material(r))
    s["post"] = {"radius": 0.25 * s["sample"].get("radius", 0.1 * board)}
    s["lights"] = lamps(r, board, s["sample"]["center"][2])
    s["bounces"] = 1 if r.random() < 0.33 and s["sample"]["shape"] == "sphere" else 0
    if s["bounces"]:  # minutes of rendering otherwise
        s["camera"].update(size=[640, 430], center_px=[322, 213])
        size = s["camera"]["size"]
        s["lights"] = s["lights"][:1]
    s["power_jitter"] = r.choice([0, 0.01])
    s["files"] = r.choice(["tiff", "tiff", "png", "jpeg", "dng"])
    s["sensor"] = {"electrons": 2e7 * r.uniform(0.5, 2), "time_error": r.choice([0, 0.04])}
    if s["files"] == "dng":
        s["sensor"] = dict(S.M.RAW, mosaic=r.choice(["rggb", "bggr", "grbg"]))
    # The board fills three quarters of the photograph.
    far = board * zoom / 0.75 * max(1, size[0] / size[1] * 0.76) if size[0] > size[1] else board * zoom / 0.75
    s["handheld"] = {"place": 0.02 * far, "aim_deg": 0.5, "roll_deg": 5}
    s["shots"] = []
    for light in s["lights"]:
        azimuth = light.get("azimuth_deg", r.uniform(0, 360)) + r.uniform(-30, 30)
        low = r.uniform(30, 45)
        target = [0, 0, 0.3 * s["sample"]["center"][2]]
        s["shots"].append({"arc": {"count": r.choice([5, 7, 10]), "azimuth_deg": azimuth, "elevation_deg": [low, low + 95],
                                   "distance": far, "target": target, "light": light["name"]}})
        for turn in (70, -110):
            s["shots"].append({"look": {"eye": S.np.array([S.np.cos(S.np.radians(azimuth + turn)) * 0.7 * far,
                                                           S.np.sin(S.np.radians(azimuth + turn)) * 0.7 * far,
                                                           0.7 * far]).tolist(), "target": target}, "light": light["name"]})
            s["shots"][-1]["look"]["light"] = s["shots"][-1].pop("light")
    return s


def told(s):
    m, c = s["sample"]["material"], s["camera"]
    lamps = ["flash" if l.get("on_camera") else "lamp %.0f mm off, radius %.0f" % (l["distance"], l["radius"]) for l in s["lights"]]
    return "%s of %s %s, board %d mm%s, f/width %.1f, %dx%d %s, %d shots; %s" % (
        s["sample"]["shape"], m["model"], "alpha %g" % m["alpha"] if "alpha" in m else "", s["board"]["size"][0],
        " lit" if s["bounces"] else "", c["focal_length"] / c["sensor_width"], *c["size"], s["files"],
        sum(x["arc"]["count"] if "arc" in x else 1 for x in s["shots"]), ", ".join(lamps))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--goniocam", default=os.path.join(TOP, "build/release/goniocam"))
    parser.add_argument("--keep")
    parser.add_argument("first", nargs="?", type=int, default=1)
    parser.add_argument("last", nargs="?", type=int)
    a = parser.parse_args()
    print("%s   bins    mm  lamp %%   s" % "".join("  to %d deg: median 95 %% signed z " % b[1] for b in S.BANDS))
    for seed in range(a.first, (a.last or (a.first if a.first > 1 else 20)) + 1):
        s = scene(seed)
        print("%d: %s" % (seed, told(s)), flush=True)
        with tempfile.TemporaryDirectory() as folder:
            if a.keep:
                folder = os.path.join(a.keep, str(seed))
                os.makedirs(folder, exist_ok=True)
            S.trip(a.goniocam, s, os.path.join(TOP, "samples"), folder)


if __name__ == "__main__":
    main()
