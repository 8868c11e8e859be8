#!/usr/bin/python3
"""What is installed works elsewhere: the program, its manual and completion, and the libraries, linked by a stranger's
project through CMake and through pkg-config.

    tests/install.py GONIOCAM PROJECT
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

failed = 0
PROGRAM = r"""
#include <reconstruct.h>
#include <stdio.h>
int main(void)
{
    double albedo[3] = {0.5, 0.25, 0.125}, f[3];
    vec3 up = {0, 0, 1};
    rec_model_find("lambert")->eval(albedo, up, up, f);
    printf("%.9f %.9f %.9f\n", f[0] * CAP_PI, f[1] * CAP_PI, f[2] * CAP_PI);
    return 0;
}
"""
PROJECT = """
cmake_minimum_required(VERSION 3.25)
project(stranger LANGUAGES C CXX)
find_package(goniocam 0.1 REQUIRED)
add_executable(stranger stranger.c)
target_link_libraries(stranger PRIVATE goniocam::reconstruct)
"""


def check(what, good):
    global failed
    failed += not good
    print("%-60s %s" % (what, "ok" if good else "FAILED"))


def said(*command, **more):
    return subprocess.run(command, capture_output=True, text=True, check=True, **more).stdout


def check_words(goniocam, commands):
    manual = said(goniocam, "manual").replace("\\-", "-")
    check("the manual tells of every command", all("goniocam %s " % c in manual for c in commands))
    check("a shell that nobody knows is a usage error",
          subprocess.run([goniocam, "completion", "csh"], capture_output=True).returncode == 2)
    with tempfile.NamedTemporaryFile("w", suffix=".bash") as script:
        script.write(said(goniocam, "completion", "bash"))
        script.flush()
        ask = ". %s; COMP_WORDS=(goniocam %%s); COMP_CWORD=%%d; _goniocam; echo ${COMPREPLY[@]}" % script.name
        check("bash completes commands", said("bash", "-c", ask % ("reco", 1)).split() == ["reconstruct"])
        check("bash completes options", said("bash", "-c", ask % ("merge --dr", 2)).split() == ["--dry-run"])


def check_link(root, folder):
    with open(os.path.join(folder, "stranger.c"), "w") as f:
        f.write(PROGRAM)
    with open(os.path.join(folder, "CMakeLists.txt"), "w") as f:
        f.write(PROJECT)
    expected = "0.500000000 0.250000000 0.125000000\n"
    built = os.path.join(folder, "built")
    said("cmake", "-S", folder, "-B", built, "-DCMAKE_PREFIX_PATH=" + root)
    said("cmake", "--build", built)
    check("find_package(goniocam): builds and evaluates", said(os.path.join(built, "stranger")) == expected)
    env = dict(os.environ, PKG_CONFIG_PATH=os.path.join(root, "lib/pkgconfig"))
    flags = said("pkg-config", "--cflags", "--libs", "goniocam", env=env).split()
    by_hand = os.path.join(folder, "by-hand")
    said("cc", os.path.join(folder, "stranger.c"), "-o", by_hand, *flags)
    check("pkg-config goniocam: builds and evaluates", said(by_hand) == expected)


def main():
    goniocam, project = sys.argv[1:3]
    commands = re.findall(r"^  ([a-z-]+) ", said(goniocam, "--help"), re.M)
    commands = [c for c in commands if not c.startswith("-")]
    check("--help lists commands", "reconstruct" in commands and "render" in commands)
    check_words(goniocam, commands)
    with tempfile.TemporaryDirectory() as folder:
        root = os.path.join(folder, "root")
        said("cmake", "--install", os.path.dirname(goniocam), "--prefix", root)
        installed = os.path.join(root, "bin/goniocam")
        check("the installed program starts", said(installed, "--version").startswith("goniocam "))
        names = ["share/man/man1/goniocam.1", "share/bash-completion/completions/goniocam", "share/doc/goniocam/README.md",
                 "share/doc/goniocam/examples/plastic-ball.yaml", "include/goniocam/reconstruct.h"]
        for name in names:
            check(name, os.path.getsize(os.path.join(root, name)) > 0)
        if shutil.which("man"):
            page = said("man", "--warnings", "-E", "UTF-8", "-l", os.path.join(root, names[0]), env=dict(os.environ, MANWIDTH="100"))
            check("man shows the page", "goniocam reconstruct CAPTURE" in page)
        check_link(root, folder)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
