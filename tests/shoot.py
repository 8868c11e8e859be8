#!/usr/bin/python3
"""goniocam shoot against libgphoto2's own drivers: no camera, and its folder that pretends to be one.

    tests/shoot.py GONIOCAM PROJECT
"""
import os
import subprocess
import sys
import tempfile

failed = 0


def expect(what, code, words, *command):
    global failed
    # libgphoto2's drivers leak and are unloaded before the end: no suppression can name them.
    quiet = dict(os.environ, ASAN_OPTIONS=os.environ.get("ASAN_OPTIONS", "") + ":detect_leaks=0")
    r = subprocess.run(command, capture_output=True, text=True, env=quiet)
    good = r.returncode == code and words in r.stderr and len(r.stderr.strip().splitlines()) == 1 or code == 2 == r.returncode
    failed += not good
    print("%-40s %s: exit %d, %s" % (what, "ok" if good else "FAILED", r.returncode, r.stderr.strip().splitlines()[:1]))


def main():
    goniocam = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        out, card = os.path.join(folder, "capture"), os.path.join(folder, "card")
        os.mkdir(card)
        pretender = ["--camera", "Directory Browse", "--port", "disk:" + card]
        expect("nothing at the cable", 1, "", goniocam, "shoot", out, "--port", "usb:")
        expect("a camera that nobody made", 1, "Pinhole 3000", goniocam, "shoot", out, "--camera", "Pinhole 3000")
        expect("a camera that cannot be controlled", 1, "cannot be controlled over the cable", goniocam, "shoot", out, *pretender)
        expect("no time", 2, "", goniocam, "shoot", out, "--times", "soon")
        if os.path.exists(out):
            print("FAILED: a folder is left")
            sys.exit(1)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
