#!/usr/bin/python3
"""Bad input: one clear message on stderr, exit code 1, nothing half-written; good photographs are kept.

    tests/bad_input.py GONIOCAM PROJECT        renders samples/tiny.yaml once and spoils copies of it
"""
import glob
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile

failed = 0


class Case:
    """A copy of the capture to spoil, and what happened when it was reconstructed."""

    def __init__(self, goniocam, capture, folder, name):
        self.goniocam, self.name = goniocam, name
        self.capture, self.out = os.path.join(folder, name), os.path.join(folder, name + "-out")
        shutil.copytree(capture, self.capture)
        self.yaml = os.path.join(self.capture, "capture.yaml")

    def photos(self, pattern="*_exp*.tif"):
        return sorted(glob.glob(os.path.join(self.capture, pattern)))

    def edit(self, old, new):
        text = open(self.yaml).read()
        assert re.search(old, text), (self.name, old)
        open(self.yaml, "w").write(re.sub(old, new, text, count=1))

    def run(self, command="reconstruct", out=None, wrapper=()):
        r = subprocess.run([*wrapper, self.goniocam, command, self.capture, "-o", out or self.out, "--quiet"],
                           capture_output=True, text=True)
        self.code, self.err = r.returncode, r.stderr
        return self

    def expect(self, code, *words):
        global failed
        lines = [l for l in self.err.splitlines() if l.strip()]
        good = self.code == code and all(w in self.err for w in words)
        good = good and (code == 0 or len([l for l in lines if "warning" not in l]) == 1)
        left = [p for p in glob.glob(self.out + "/**/*", recursive=True) if p.endswith((".part", ".tmp")) or ".aside" in p]
        good = good and not left
        failed += not good
        print("%-28s %s: exit %d%s\n    %s" % (self.name, "ok" if good else "FAILED", self.code, " left %s" % left if left else "",
                                             "\n    ".join(lines) or "(silent)"))
        return self

    def absent(self, *names):
        """None of these results may have been written."""
        global failed
        for n in names:
            if os.path.exists(os.path.join(self.out, n)):
                failed += 1
                print("    FAILED: %s was written" % n)

    def present(self, *names):
        global failed
        for n in names:
            if not os.path.exists(os.path.join(self.out, n)):
                failed += 1
                print("    FAILED: %s is missing" % n)


def truncate(path, part):
    os.truncate(path, int(os.path.getsize(path) * part))


def strip_exif(path):
    """Rename the EXIF tag in a little-endian TIFF's directory, so that no reader finds it."""
    data = bytearray(open(path, "rb").read())
    at, = struct.unpack_from("<I", data, 4)
    entries, = struct.unpack_from("<H", data, at)
    places = [at + 2 + 12 * i for i in range(entries) if struct.unpack_from("<H", data, at + 2 + 12 * i)[0] == 34665]
    struct.pack_into("<H", data, places[0], 65000)
    open(path, "wb").write(data)


RESULTS = ("brdf.binary", "bins.h5", "fits.yaml", "calibration.yaml")


def cases(case):
    c = case("no-photographs")
    for p in c.photos("*.tif"):
        os.remove(p)
    c.run().expect(1, c.capture, "no photograph").absent(*RESULTS)

    c = case("no-folder")
    shutil.rmtree(c.capture)
    c.run().expect(1, c.capture).absent(*RESULTS)

    c = case("no-capture-yaml")
    os.remove(c.yaml)
    c.run().expect(1, "there is no capture.yaml", "goniocam init").absent(*RESULTS)
    c.capture += "-of-nowhere"
    c.run().expect(1, "there is no such folder", c.capture).absent(*RESULTS)

    c = case("truncated-photograph")
    bad = c.photos()[1]
    truncate(bad, 0.6)
    c.run().expect(0, "warning", os.path.basename(bad)).present(*RESULTS)

    c = case("not-a-photograph")
    bad = c.photos()[2]
    open(bad, "w").write("this is no TIFF\n")
    c.run().expect(0, "warning", os.path.basename(bad)).present(*RESULTS)

    c = case("empty-photograph")
    bad = c.photos()[0]
    truncate(bad, 0)
    c.run().expect(0, "warning", os.path.basename(bad)).present(*RESULTS)

    c = case("no-exposure-time")
    for p in c.photos():
        strip_exif(p)
    c.run().expect(1, "exposure", os.path.basename(c.photos()[0]), "overrides").absent(*RESULTS)

    c = case("unknown-key")
    c.edit("(?m)^sample:", "smaple:")
    c.run().expect(1, "capture.yaml", "smaple", "line").absent(*RESULTS)

    c = case("wrong-type")
    c.edit(r"radius: *[0-9.]+", "radius: large")
    c.run().expect(1, "capture.yaml", "radius", "line").absent(*RESULTS)

    c = case("two-usable-shots")
    shots = sorted({os.path.basename(p).split("_")[0] for p in c.photos()})
    for s in shots[2:]:
        for p in c.photos(s + "_*.tif"):
            os.remove(p)
    c.run().expect(1, "at least 3").absent(*RESULTS)

    c = case("tagless-shot")
    shot = os.path.basename(c.photos()[0]).split("_")[0]
    blacken(c, shot)
    c.run().expect(0, "warning", shot, "tag").present(*RESULTS)

    c = case("out-not-writable")
    c.run(out="/proc/goniocam").expect(1, "/proc/goniocam")

    c = case("out-is-a-file")
    open(c.out, "w").write("mine\n")
    c.run().expect(1, c.out)
    assert open(c.out).read() == "mine\n"

    disk_full(case)


def blacken(c, shot):
    """Make a shot's photographs show nothing: their own exposures, all samples at one level."""
    for p in c.photos(shot + "_*.tif"):
        subprocess.check_call(["/usr/bin/python3", "-B", "-c", FLATTEN, p])


# Overwrite the strips of a TIFF with one level, keeping its tags: done by appending new strips.
FLATTEN = r"""
import struct, sys, zlib
path = sys.argv[1]
data = bytearray(open(path, "rb").read())
at, = struct.unpack_from("<I", data, 4)
n, = struct.unpack_from("<H", data, at)
tags = {}
for i in range(n):
    tag, kind, count, value = struct.unpack_from("<HHII", data, at + 2 + 12 * i)
    tags[tag] = (at + 2 + 12 * i, kind, count, value)
width, height = (struct.unpack_from("<I" if tags[t][1] == 4 else "<H", data, tags[t][0] + 8)[0] for t in (256, 257))
rows = struct.unpack_from("<I" if tags[278][1] == 4 else "<H", data, tags[278][0] + 8)[0]
strips = tags[273][2]
def put(tag, index, number):
    place, kind, count, value = tags[tag]
    size = 4 if kind == 4 else 2
    where = place + 8 if size * count <= 4 else value
    struct.pack_into("<I" if kind == 4 else "<H", data, where + size * index, number)
for s in range(strips):
    lines = min(rows, height - s * rows)
    first = struct.pack("<3H", 140, 140, 140)
    predicted = tags[317][3] & 0xffff == 2 if 317 in tags else False
    row = first + (b"\0" if predicted else first[:1]) * 0
    line = first + b"\0" * 6 * (width - 1) if predicted else first * width
    strip = zlib.compress(line * lines)
    put(273, s, len(data))
    put(279, s, len(strip))
    data += strip
open(path, "wb").write(data)
"""


def disk_full(case):
    """On a file system of one megabyte (needs the right to mount one)."""
    c = case("disk-full")
    os.mkdir(c.out)
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1M", "none", c.out], capture_output=True).returncode:
        print("%-28s skipped: cannot mount a small file system" % c.name)
        return
    try:
        c.run().expect(1, c.out, "space").absent(*RESULTS)
    finally:
        subprocess.call(["umount", c.out])


def main():
    goniocam, project = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        capture = os.path.join(folder, "capture")
        subprocess.check_call([goniocam, "render", os.path.join(project, "samples/tiny.yaml"), "-o", capture, "--quiet"],
                              stdout=subprocess.DEVNULL)
        cases(lambda name: Case(goniocam, capture, folder, name))
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
