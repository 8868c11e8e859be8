#!/usr/bin/python3
"""Room light: a photograph without the lamp takes it out, and what is left is what the lamp alone would have shown.

    tests/room_light.py GONIOCAM PROJECT
"""
import os
import subprocess
import sys
import tempfile

import cv2  # reads half and float OpenEXR
import numpy as np
import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import limits
from limits import check

os.environ["OPENCV_IO_ENABLE_OPENEXR"] = "1"


def main():
    goniocam, project = sys.argv[1:3]
    run = lambda *a: subprocess.check_call([goniocam, *a, "--quiet"], stdout=subprocess.DEVNULL)
    with tempfile.TemporaryDirectory() as folder:
        at = lambda n: os.path.join(folder, n)
        with open(os.path.join(project, "samples/tiny.yaml")) as f:
            scene = yaml.safe_load(f)
        arc = scene["shots"][0]["arc"]
        scene["shots"] = [{"arc": dict(arc, count=1)}]
        scene["radiance"] = True

        def merged(name, **changes):
            with open(at(name + ".yaml"), "w") as f:
                yaml.safe_dump(dict(scene, **changes), f)
            run("render", at(name + ".yaml"), "-o", at(name))
            run("merge", at(name), "-o", at(name + "-out"))
            out = os.path.join(at(name + "-out"), "radiance")
            maps = [cv2.imread(os.path.join(out, f), cv2.IMREAD_UNCHANGED) for f in sorted(os.listdir(out))]
            return maps[0] if len(maps) == 1 else np.concatenate(maps)

        alone = merged("alone")
        room = 0.05 * float(cv2.imread(os.path.join(at("alone"), "radiance", "shot00.exr"), cv2.IMREAD_UNCHANGED).max())
        lit = merged("lit", ambient=[room] * 3)
        corrected = merged("corrected", ambient=[room] * 3, ambient_frame=True)
        bright = np.isfinite(alone).all(-1) & (alone.min(-1) > 0.1 * np.nanmedian(alone))
        more = np.median((lit / alone)[bright])
        check("room light, of the lamp's (not corrected), median", more - 1, 0.02, 10)
        check("left of it, of what there was", abs(np.median((corrected / alone)[bright]) - 1) / (more - 1), 0, 0.02)
        # The camera moves: each shot has a photograph of its own without the lamp.
        scene["shots"] = [{"arc": dict(arc, count=3)}]
        alone = merged("alone3")
        lit = merged("lit3", ambient=[room] * 3)
        each = merged("each3", ambient=[room] * 3, ambient_frame="each")
        bright = np.isfinite(alone).all(-1) & (alone.min(-1) > 0.1 * np.nanmedian(alone))
        for k, rows in enumerate(np.split(np.arange(len(alone)), 3)):
            of = lambda m: np.median((m[rows] / alone[rows])[bright[rows]]) - 1
            check(f"left of it in view {k}, of what there was", abs(of(each)) / of(lit), 0, 0.02)
        # Whatever the files: mosaics, and codes whose curve is found from the brackets. A dry run tells which frame is whose.
        scene["shots"] = [{"arc": dict(arc, count=2)}]
        for kind, more in (("dng", {"sensor": {"mosaic": "rggb"}}), ("jpeg", {})):
            changes = dict(more, files=kind)
            alone, lit = merged("alone-" + kind, **changes), merged("lit-" + kind, ambient=[room] * 3, **changes)
            each = merged("each-" + kind, ambient=[room] * 3, ambient_frame="each", **changes)
            said = subprocess.check_output([goniocam, "merge", at("each-" + kind), "--dry-run"], text=True).split("ambient frames")[1]
            own = [line.split()[-1].startswith("ambient%02d." % k) for k, line in enumerate(said.strip().splitlines())]
            check(f"{kind}: frames told to be of the shot they were taken for", sum(own), 2, 2)
            bright = np.isfinite(alone) & (alone > 0.1 * np.nanmedian(alone))
            of = lambda m: np.median(m[bright] / alone[bright]) - 1
            check(f"{kind}: left of it, of what there was", abs(of(each)) / of(lit), 0, 0.02)
    sys.exit(1 if limits.failed else 0)


if __name__ == "__main__":
    main()
