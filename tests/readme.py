#!/usr/bin/python3
"""Every command of the README, run in its order, as a person would who reads it.

    tests/readme.py GONIOCAM PROJECT

Commands stand in blocks that begin with ```sh. (`sh samples/demo.sh` and `sh tests/run.sh` are what CI itself runs.)
"""
import os
import re
import subprocess
import sys
import tempfile


def main():
    goniocam, project = sys.argv[1:3]
    text = open(os.path.join(project, "README.md")).read()
    blocks = re.findall(r"^```sh\n(.*?)^```", text, re.M | re.S)
    commands = [line for block in blocks for line in block.splitlines() if line.strip()]
    env = dict(os.environ, PATH=os.path.dirname(goniocam) + ":" + os.environ["PATH"], OMPI_MCA_rmaps_base_oversubscribe="1")
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        os.symlink(os.path.join(project, "samples"), os.path.join(folder, "samples"))
        for command in commands:
            # Open MPI's plugins leak at exit and are unloaded by then: no suppression can name them.
            options = os.environ.get("ASAN_OPTIONS", "") + (":detect_leaks=0" if command.startswith("mpirun") else "")
            r = subprocess.run(["bash", "-ec", command], cwd=folder, env=dict(env, ASAN_OPTIONS=options), capture_output=True, text=True)
            failed += r.returncode != 0
            print("%-8s %s" % ("ok" if r.returncode == 0 else "FAILED", command))
            if r.returncode:
                print(r.stdout[-2000:] + r.stderr[-2000:])
        made = [name for name in ("board.pdf", "board.yaml", "begun.yaml", "plan.png", "ball-brdf/report.html", "ball.xml", "lobes.pdf")
                if os.path.getsize(os.path.join(folder, name)) > 0]
        print("made:", ", ".join(made))
    told = re.findall(r"`goniocam ([a-z-]+)", text)
    listed = subprocess.run([goniocam, "--help"], capture_output=True, text=True).stdout
    known = [c for c in re.findall(r"^  ([a-z][a-z-]+) ", listed, re.M)]
    for command in sorted(set(told) | set(known)):
        if command not in known or command not in told:
            failed += 1
            print("FAILED: %s: %s" % (command, "the README tells of it, the program has none" if command not in known
                                      else "the README does not tell of it"))
    sys.exit(1 if failed or len(commands) < 10 else 0)


if __name__ == "__main__":
    main()
