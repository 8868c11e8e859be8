#!/usr/bin/python3
"""Samples that no BRDF describes are told: stained, grained; an even one is not.

    tests/flaws.py GONIOCAM PROJECT

Renders samples/tiny.yaml, under two lamps, with each flaw and without any: what is uneven shows where shots see the
same angles at different places of the sample.
"""
import json
import os
import subprocess
import sys
import tempfile

import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import truth as T

failed = 0
# What is wrong with the sample, and a phrase of the warning.
FLAWS = {
    "none": ({}, None),
    "spots": ({"spots": 0.15}, "opaque"),
    "grain": ({"grain": 0.15}, "it has a grain"),
}
PHRASES = [phrase for _, phrase in FLAWS.values() if phrase] + ["are not interchangeable", "does not reach"]


def check(what, good, detail=""):
    global failed
    failed += not good
    print("%-64s %s %s" % (what, "ok" if good else "FAILED", detail))


def main():
    goniocam, project = sys.argv[1:3]
    tiny = T.load(os.path.join(project, "samples/tiny.yaml"))
    tiny["lights"] = [{"name": "left", "azimuth_deg": 250, "elevation_deg": 35, "distance": 600},
                      {"name": "right", "azimuth_deg": 310, "elevation_deg": 50, "distance": 550}]
    tiny["shots"] = [{"arc": {"count": 6, "azimuth_deg": 285, "elevation_deg": [40, 140], "distance": 640,
                              "target": [0, 0, 25], "light": name}} for name in ("left", "right")]
    with tempfile.TemporaryDirectory() as folder:
        at = lambda *names: os.path.join(folder, *names)
        run = lambda *a: subprocess.check_call([goniocam, *a, "--quiet"], stdout=subprocess.DEVNULL,
                                               stderr=subprocess.DEVNULL)
        for name, (flaws, phrase) in FLAWS.items():
            scene = dict(tiny, sample=dict(tiny["sample"], flaws=flaws))
            with open(at(name + ".yaml"), "w") as f:
                yaml.safe_dump(scene, f)
            run("render", at(name + ".yaml"), "-o", at(name))
            run("reconstruct", at(name), "-o", at(name + "-out"))
            run_json = json.load(open(at(name + "-out", "run.json")))
            warned = [p for p in PHRASES if any(p in w for w in run_json["warnings"])]
            figures = {k: "%.3g +- %.2g" % (v["rms_relative"], v["sigma"])
                       for k, v in run_json["checks"].items() if k in ("isotropy", "homogeneity")}
            if phrase:
                check("flaw '%s' is named" % name, phrase in warned, "%s %s" % (warned, figures))
            else:
                check("nothing is said of an even sample", not warned, "%s %s" % (warned, figures))
            dark = {zone: run_json["checks"][zone]["part_of_lamp"] for zone in ("dusk", "night")}
            check("'%s': the dark side is dark, to 0.1 %% of the lamp" % name, all(abs(d) < 1e-3 for d in dark.values()), dark)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
