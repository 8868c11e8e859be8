#!/usr/bin/python3
"""Materials outside all families: BRDFs of explicit geometry, by goniocam goniometer, tried on the rest of the program.

    tests/bench/geometry.py [--goniocam build/release/goniocam] [--rays 3e6] [SURFACE.yaml...]

For each surface (default: samples/surface-*.yaml) prints the light's balance, the check's verdicts, the models' ranking
with the best fit's error over the whole table, and what a reconstruction from six rendered photographs of a ball of it
(samples/tiny.yaml) makes of it: the error of measured bins, and of the complete table, whose other bins were filled.
"""
import argparse
import glob
import json
import os
import re
import subprocess
import tempfile

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))


def told(args):
    """A command's JSON; check's exit code is its verdict."""
    done = subprocess.run([*args, "--json", "--quiet"], capture_output=True, text=True)
    assert done.stdout, "%s\n%s" % (args, done.stderr)
    return json.loads(done.stdout)


def errors(name, e):
    print("  %-34s median %6.2f %%  95 %% %7.1f %%  log rms %.3f" % (
        name, 100 * e["relative_median"], 100 * e["relative_95"], e["log_rms"]))


def reconstruct(goniocam, table, work):
    scene = open(os.path.join(TOP, "samples/tiny.yaml")).read()
    scene = re.sub(r"material: \{model.*\}", "material: {table: %s}" % table, scene)
    path, capture, out = (os.path.join(work, n) for n in ("scene.yaml", "capture", "out"))
    open(path, "w").write(scene)
    for command in (["render", path, "-o", capture], ["reconstruct", capture, "-o", out]):
        subprocess.check_call([goniocam, *command, "--quiet"], stdout=subprocess.DEVNULL)
    errors("reconstructed: measured bins", told([goniocam, "compare", table, out, "--mask", out])["all"])
    whole = told([goniocam, "compare", table, out])
    errors("reconstructed: whole table", whole["all"])
    print("  %-34s PSNR %.1f dB" % ("", whole["sphere"]["psnr"]))


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--goniocam", default=os.path.join(TOP, "build/release/goniocam"))
    options.add_argument("--rays", type=float, default=3e6)
    options.add_argument("surface", nargs="*", default=sorted(glob.glob(os.path.join(TOP, "samples/surface-*.yaml"))))
    given = options.parse_args()
    for surface in given.surface:
        with tempfile.TemporaryDirectory() as work:
            path, table, fits = (os.path.join(work, n) for n in ("s.yaml", "s.binary", "fits.yaml"))
            open(path, "w").write(re.sub(r"(?m)^rays:.*$", "rays: %.1e" % given.rays, open(surface).read()))
            light = told([given.goniocam, "goniometer", path, "-o", table])
            print("%s: %.4f left, %.4f absorbed, %.4f lost" % (
                os.path.basename(surface), light["out"], light["absorbed"], light["lost"]))
            check = told([given.goniocam, "check", table])
            print("  check: " + ", ".join("%s %s" % (k, "good" if v else "BAD") for k, v in check["good"].items()))
            subprocess.check_call([given.goniocam, "fit", table, "-o", fits, "--quiet"], stdout=subprocess.DEVNULL)
            print("  models, best first: " + " ".join(re.findall(r"(?m)^- name: (\S+)", open(fits).read())))
            best = told([given.goniocam, "compare", table, fits])
            errors("best fit", best["all"])
            print("  %-34s PSNR %.1f dB" % ("", best["sphere"]["psnr"]))
            reconstruct(given.goniocam, table, work)


if __name__ == "__main__":
    main()
