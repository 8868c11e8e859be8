#!/usr/bin/python3
"""What a report of 30 shots costs: its size, and the time to write it on two cores.

    tests/bench/report_cost.py GONIOCAM [PROJECT]
"""
import os
import resource
import subprocess
import sys
import tempfile
import time

import yaml


def main():
    goniocam = os.path.realpath(sys.argv[1])
    project = sys.argv[2] if len(sys.argv) > 2 else os.path.join(os.path.dirname(os.path.realpath(__file__)), "../..")
    with open(os.path.join(project, "samples/plastic-ball.yaml")) as file:
        scene = yaml.safe_load(file)
    scene["exposures"] = scene["exposures"][1:3]
    arc = {"count": 10, "azimuth_deg": 280, "elevation_deg": [38, 157], "distance": 660, "target": [0, 0, 30]}
    scene["shots"] = [{"arc": dict(arc, azimuth_deg=a)} for a in (280, 220, 330)]
    quiet = dict(stdout=subprocess.DEVNULL)
    with tempfile.TemporaryDirectory() as folder:
        with open(folder + "/scene.yaml", "w") as file:
            yaml.safe_dump(scene, file)
        subprocess.check_call([goniocam, "render", folder + "/scene.yaml", "-o", folder + "/capture", "--quiet"], **quiet)
        subprocess.check_call([goniocam, "reconstruct", folder + "/capture", "-o", folder + "/out", "--quiet"], **quiet)
        before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        subprocess.check_call([goniocam, "report", folder + "/out", "--threads", "2", "--quiet"])
        wall, after = time.monotonic() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
        size = os.path.getsize(folder + "/out/report.html")
        print("30 shots of 900 x 600: report.html %.2f MB (asked: 15); written in %.2f s wall, %.2f s of CPU (asked: 10 s)"
              % (size / 1e6, wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime))
        with open(folder + "/out/run.json") as file:
            stages = {s["name"]: s["seconds"] for s in yaml.safe_load(file)["stages"]}
        print("in reconstruct: predictions %.2f s" % stages["predictions"])
    sys.exit(0)


if __name__ == "__main__":
    main()
