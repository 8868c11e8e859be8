#!/usr/bin/python3
"""The shots that `goniocam plan` proposes, rendered and added, measure the bins that it promised.

    tests/plan.py GONIOCAM PROJECT [--keep FOLDER]
"""
import json
import os
import subprocess
import sys
import tempfile

import h5py
import yaml

failed = 0


def check(what, good):
    global failed
    failed += not good
    print("%-70s %s" % (what, "ok" if good else "FAILED"))


def measured(out):
    with h5py.File(os.path.join(out, "bins.h5"), "r") as f:
        return f["status"][...] == 1


def main():
    goniocam, project = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        at = lambda name: os.path.join(folder, name)

        def photograph(scene, name):
            with open(at(name + ".yaml"), "w") as f:
                yaml.safe_dump(scene, f)
            subprocess.check_call([goniocam, "render", at(name + ".yaml"), "-o", at(name), "--quiet"],
                                  stdout=subprocess.DEVNULL)
            subprocess.check_call([goniocam, "reconstruct", at(name), "-o", at(name + "-out"), "--quiet"],
                                  stdout=subprocess.DEVNULL)
            return measured(at(name + "-out"))

        scene = yaml.safe_load(open(os.path.join(project, "samples/tiny.yaml")))
        before = photograph(scene, "before")
        told = json.loads(subprocess.check_output([goniocam, "plan", at("before-out"), "--json", "--quiet", "-o", at("plan.svg")]))
        check("a picture of it", "with the proposed shots" in open(at("plan.svg")).read() or os.path.getsize(at("plan.svg")) > 10000)
        proposals = told["proposals"]
        check("five shots are proposed", len(proposals) == 5)
        scene["shots"] += [{"look": {"eye": p["eye"], "target": p["target"]}} for p in proposals]
        after = photograph(scene, "after")
        promised = sum(p["new_bins"] for p in proposals)
        kept = (after & ~before).sum()
        print("promised %d new bins, %d came (%.1f %%)" % (promised, kept, 100 * kept / promised))
        check("at least 90 % of the promised bins are measured", kept >= 0.9 * promised)
        # Fewer promises than what comes would be no plan either.
        check("hardly more than that", kept <= 1.1 * promised)

        # Of a scene that nobody photographed, the same shots are known by their places alone.
        table = subprocess.check_output([goniocam, "plan", at("before.yaml"), "--shots", "0", "--json", "--quiet"])
        geometric = json.loads(table)["measured"][2]
        share = before.sum() / 1096216
        print("of the scene: %.3f %% of the table, measured %.3f %%" % (100 * geometric, 100 * share))
        check("a scene's coverage is what its photographs measure, to 5 %", abs(geometric / share - 1) < 0.05)
        moved = json.loads(subprocess.check_output([goniocam, "plan", at("before-out"), "--move-lamp", "--json", "--quiet"]))
        check("with the lamp free, more can be won",
              sum(p["new_bins"] for p in moved["proposals"]) > 0 and any(p["move_lamp"] for p in moved["proposals"]))
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
