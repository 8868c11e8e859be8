#!/usr/bin/python3
"""Of two lamps the second never lights the white patch: paper and sample, which the first lights too, tell its power.

    tests/patch_in_shadow.py GONIOCAM PROJECT

samples/tiny.yaml with a second lamp whose light on the patch the ball keeps off.
"""
import json
import os
import subprocess
import sys
import tempfile

import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import limits
from limits import check
from rendered import render


def intensities(path, load):
    with open(path) as f:
        return [sum(light["intensity"]) / 3 for light in load(f)["lights"]]


def main():
    goniocam, project = sys.argv[1:3]
    with open(os.path.join(project, "samples/tiny.yaml")) as f:
        scene = yaml.safe_load(f)
    # The ball's shadow falls where the patch lies: 45 mm / tan 39 degrees from under its middle.
    scene["lights"].append(dict(scene["lights"][0], name="behind", azimuth_deg=180, elevation_deg=39, intensity=8e4))
    scene["patch"]["size"] = 22
    scene["shots"] = [dict(shot, arc=dict(shot["arc"], light=light)) for shot in scene["shots"][:1]
                      for light in ("lamp", "behind")]
    with tempfile.TemporaryDirectory() as folder:
        at = lambda name: os.path.join(folder, name)
        render(goniocam, scene, folder)
        done = subprocess.run([goniocam, "calibrate", at("capture"), "-o", at("out"), "--quiet"], text=True,
                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        print(done.stderr, end="")
        check("exit status", done.returncode, 0, 0)
        check("warnings that name the lamp", done.stderr.count("lamp behind: the white patch is never lit"), 1, 1)
        true = intensities(at("capture/truth.json"), json.load)
        found = intensities(at("out/calibration.yaml"), yaml.safe_load)
        # A capture of four views a lamp: 1 % is what power is known to where a patch is seen so seldom.
        check("the second lamp's power over the first's, over the true", found[1] / found[0] / (true[1] / true[0]),
              0.99, 1.01)
    sys.exit(1 if limits.failed else 0)


if __name__ == "__main__":
    main()
