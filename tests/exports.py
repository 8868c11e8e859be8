#!/usr/bin/python3
"""goniocam export, check and compare as commands: each format is written and holds what it should, text formats come
back as the BRDF they were, verdicts are exit codes.

    tests/exports.py GONIOCAM PROJECT
"""
import json
import math
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

PLASTIC = {"model": "ggx", "parameters": {"albedo": [0.4, 0.2, 0.1], "alpha": 0.16, "ior": 1.6}}
GOLD = {"model": "ggx_schlick", "parameters": {"albedo": [0, 0, 0], "f0": [0.9, 0.7, 0.3], "alpha": 0.09, "edge": 1}}


def run(*args, code=0, stdin=None):
    done = subprocess.run([sys.argv[1], *args], capture_output=True, text=True, input=stdin)
    assert done.returncode == code, "%s: exit %d, not %d\n%s%s" % (args, done.returncode, code, done.stdout, done.stderr)
    return done.stdout if not code else done.stdout + done.stderr


def near(a, b, tolerance=1e-5):
    assert abs(a - b) <= tolerance * max(1, abs(b)), "%r is not %r" % (a, b)


def numbers(text):
    return [float(x) for x in re.findall(r"[-+0-9.e]+", text)]


def check_xml(path):
    if shutil.which("xmllint"):
        subprocess.check_call(["xmllint", "--noout", path])
    return ElementTree.parse(path).getroot()


def mitsuba(work):
    bsdf = check_xml(os.path.join(work, "plastic.xml")).find("bsdf")
    assert bsdf.get("type") == "roughplastic"
    value = {e.get("name"): e.get("value") for e in bsdf}
    f0 = (0.6 / 2.6) ** 2
    near(float(value["alpha"]), 0.16)
    near(float(value["int_ior"]), 1.6)
    near(numbers(value["diffuse_reflectance"])[0], 0.4 / (1 - f0))
    metal = {e.get("name"): e.get("value") for e in check_xml(os.path.join(work, "gold.xml")).find("bsdf")}
    for eta, k, r in zip(numbers(metal["eta"]), numbers(metal["k"]), (0.9, 0.7, 0.3)):
        near(((eta - 1) ** 2 + k ** 2) / ((eta + 1) ** 2 + k ** 2), r, 1e-4)  # Fresnel's at normal incidence


def pbrt(work):
    text = open(os.path.join(work, "plastic.pbrt")).read()
    assert '"string type" [ "coateddiffuse" ]' in text and '"bool remaproughness" [ false ]' in text
    near(numbers(re.search(r'"float roughness" \[(.*)\]', text).group(1))[0], 0.16)
    near(numbers(re.search(r'"float eta" \[(.*)\]', text).group(1))[0], 1.6)


def materialx(work):
    root = check_xml(os.path.join(work, "gold.mtlx"))
    surface = {e.get("name"): e.get("value") for e in root.find("standard_surface")}
    near(float(surface["metalness"]), 1)
    near(float(surface["specular_roughness"]), 0.3)
    near(numbers(surface["base_color"])[1], 0.7)
    node = root.find("surfacematerial").find("input").get("nodename")
    assert node == root.find("standard_surface").get("name")


def gltf(work):
    root = json.load(open(os.path.join(work, "plastic.gltf")))
    material = root["materials"][0]
    assert root["asset"]["version"] == "2.0" and root["extensionsUsed"] == ["KHR_materials_ior"]
    near(material["extensions"]["KHR_materials_ior"]["ior"], 1.6)
    near(material["pbrMetallicRoughness"]["roughnessFactor"], 0.4)
    near(material["pbrMetallicRoughness"]["metallicFactor"], 0)
    assert len(material["pbrMetallicRoughness"]["baseColorFactor"]) == 4


def exr(work):
    """Uncompressed scan lines: header, table of offsets, then y, size and B, G, R of each row."""
    data = open(os.path.join(work, "plastic_sphere.exr"), "rb").read()
    assert data[:4] == b"\x76\x2f\x31\x01"
    row = 8 + 3 * 256 * 4
    middle = struct.unpack_from("<768f", data, len(data) - 128 * row + 8)  # row 128
    albedo = middle[512 + 128]  # red of its middle: chalk's part is albedo cos(30)
    assert 0.4 * math.cos(math.radians(30)) < albedo < 0.4, albedo
    assert os.path.getsize(os.path.join(work, "plastic_slice.exr")) > 90 * 90 * 12


def text_formats(work):
    line = "40 20 120\n5 5 180\n"
    want = numbers(run("eval", os.path.join(work, "plastic.json"), stdin=line))
    for name in ("copy.json", "plastic.binary", "plastic.csv"):
        got = numbers(run("eval", os.path.join(work, name), stdin=line))
        for a, b in zip(got, want):
            near(a / b, 1, 0.01 if name != "copy.json" else 1e-6)
    found = json.loads(run("compare", os.path.join(work, "plastic.json"), os.path.join(work, "plastic.binary"), "--json"))
    assert found["all"]["relative_95"] < 1e-6 and found["all"]["bins"] == 1096216
    assert len(found["red"]["by_angle"]) == 5
    picture = os.path.join(work, "compare.png")
    run("compare", os.path.join(work, "plastic.binary"), os.path.join(work, "gold.json"), "-o", picture)
    assert open(picture, "rb").read(4) == b"\x89PNG"


def verdicts(work):
    plastic, bright = os.path.join(work, "plastic.json"), os.path.join(work, "bright.json")
    assert json.loads(run("check", plastic, "--json"))["sound"] is True
    json.dump({"model": "blinn_phong", "parameters": {"kd": [0.3] * 3, "ks": [0.9] * 3, "ke": [5] * 3}}, open(bright, "w"))
    told = run("check", bright, code=1)
    assert "BAD  energy" in told and "not to be trusted" in told
    assert "no photograph" not in run("info", plastic) and "parameters" in run("info", plastic)


def usage(work):
    plastic = os.path.join(work, "plastic.json")
    assert "materialx" in run("export", plastic, "--to", "word", code=2)
    run("export", plastic, code=2)
    assert "nothing.binary" in run("check", os.path.join(work, "nothing.binary"), code=1)
    run("export", plastic, "--to", "merl", "-o", "/proc/none/x.binary", code=1)


def main():
    with tempfile.TemporaryDirectory() as work:
        for name, what in (("plastic", PLASTIC), ("gold", GOLD)):
            source = os.path.join(work, name + ".json")
            json.dump(what, open(source, "w"))
            for to, ending in (("mitsuba", ".xml"), ("pbrt", ".pbrt"), ("materialx", ".mtlx"), ("gltf", ".gltf")):
                run("export", source, "--to", to, "-o", os.path.join(work, name + ending), "--quiet")
        for to, name in (("merl", "plastic.binary"), ("csv", "plastic.csv"), ("exr", "plastic.exr"), ("json", "copy.json")):
            run("export", os.path.join(work, "plastic.json"), "--to", to, "-o", os.path.join(work, name), "--quiet")
        for check in (mitsuba, pbrt, materialx, gltf, exr, text_formats, verdicts, usage):
            check(work)
            print("%-14s good" % check.__name__)


if __name__ == "__main__":
    main()
