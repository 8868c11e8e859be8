#!/usr/bin/python3
"""A mesh whose file has another size than the sample is told, with the scale that fits; one of the right size is not.

    tests/mesh_size.py GONIOCAM PROJECT

samples/tiny.yaml with a vase, rendered once; capture.yaml then says other scales of its file.
"""
import os
import re
import subprocess
import sys
import tempfile

import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import limits
import round_trip_matrix as M
from limits import check
from rendered import render

TRUE = 0.9  # of the vase's file


def main():
    goniocam, project = sys.argv[1:3]
    with open(os.path.join(project, "samples/tiny.yaml")) as f:
        scene = yaml.safe_load(f)
    scene["sample"] = dict(M.VASE, scale=TRUE, file=os.path.join(project, "samples", M.VASE["file"]), material=M.PLASTIC)
    with tempfile.TemporaryDirectory() as folder:
        at = lambda name: os.path.join(folder, name)
        render(goniocam, scene, folder)
        with open(at("capture/capture.yaml")) as f:
            capture = yaml.safe_load(f)
        for wrong in 1, 1.14, 0.88, 1.02:
            capture["sample"]["scale"] = TRUE * wrong
            with open(at("capture/capture.yaml"), "w") as f:
                yaml.safe_dump(capture, f)
            told = subprocess.run([goniocam, "calibrate", at("capture"), "-o", at("out"), "--quiet"], text=True,
                                  stdout=subprocess.DEVNULL, stderr=subprocess.PIPE).stderr
            found = re.search(r"mesh is not of the sample's size.*`scale: ([0-9.]+)`", told)
            print("a file of %g of the sample's size" % wrong)
            if wrong == 1:
                check("  warnings of its size", found is not None, 0, 0)
            else:
                check("  the scale that is told, over the true one", float(found[1]) / TRUE if found else 0, 0.99, 1.01)
    sys.exit(1 if limits.failed else 0)


if __name__ == "__main__":
    main()
