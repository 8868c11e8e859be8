#!/usr/bin/python3
"""What a person sees: bars and colours on a terminal only, a summary at the end, Ctrl-C that leaves nothing half-written.

    tests/terminal.py GONIOCAM PROJECT
"""
import os
import pty
import signal
import subprocess
import sys
import tempfile
import time

failed = 0


def check(what, good):
    global failed
    failed += not good
    print("%-60s %s" % (what, "ok" if good else "FAILED"))


def on_terminal(command, **env):
    """What a command says where all three streams are a terminal."""
    said = bytearray()
    pid, fd = pty.fork()
    if pid == 0:
        os.environ.pop("NO_COLOR", None)
        os.environ.update(env)
        os.execv(command[0], command)
    while True:
        try:
            piece = os.read(fd, 65536)
        except OSError:  # Linux says so where the other end is closed
            break
        if not piece:
            break
        said += piece
    os.waitpid(pid, 0)
    return said.decode()


def main():
    goniocam, project = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        at = lambda name: os.path.join(folder, name)
        subprocess.check_call([goniocam, "render", project + "/samples/tiny.yaml", "-o", at("capture"), "--quiet"],
                              stdout=subprocess.DEVNULL)
        command = [goniocam, "reconstruct", at("capture"), "-o"]
        bars = on_terminal(command + [at("bars")])
        check("a terminal: bars, with colour", "\x1b[K" in bars and "\x1b[32m" in bars and "6/6" in bars)
        plain = on_terminal(command + [at("bars")], NO_COLOR="1")
        check("NO_COLOR: bars without", "\x1b[K" in plain and "\x1b[32m" not in plain)

        log = subprocess.run(command + [at("log")], capture_output=True, text=True)
        lines = log.stderr.splitlines()
        check("a log: plain lines, a stage each", "\x1b" not in log.stderr and "\r" not in log.stderr
              and any(l.startswith("merge") for l in lines) and all(l.endswith(" s") for l in lines))
        check("a summary at the end", all(w in log.stdout for w in ("calibration", "standard error", "best fit", "brdf.binary")))
        quiet = subprocess.run(command + [at("log"), "--quiet"], capture_output=True, text=True)
        check("--quiet: no progress", quiet.stderr == "" and "best fit" in quiet.stdout)

        for name, after in (("early", 0.05), ("later", 0.5), ("late", 1.5)):
            p = subprocess.Popen(command + [at("stopped")], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
            time.sleep(after)
            p.send_signal(signal.SIGINT)
            story = p.communicate()[1].decode()
            left = [n for _, _, names in os.walk(at("stopped")) for n in names if n.endswith(".part")]
            # Before the program has begun to wait for it, the signal ends it at once: nothing is written then.
            told = p.returncode == 130 and "goes on from there" in story
            check("Ctrl-C, %s: says how to go on, leaves nothing" % name,
                  not left and (p.returncode == 0 or told or (p.returncode == -signal.SIGINT and not os.path.exists(at("stopped")))))
        check("run again: goes on to the end", subprocess.run(command + [at("stopped"), "--quiet"],
                                                              stdout=subprocess.DEVNULL).returncode == 0)
        same = open(at("stopped/brdf.binary"), "rb").read() == open(at("log/brdf.binary"), "rb").read()
        check("with the same bytes", same)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
