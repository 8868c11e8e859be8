"""A scene of a test's own, photographed."""
import os
import subprocess

import yaml


def render(goniocam, scene, folder):
    """Writes FOLDER/scene.yaml, and its photographs to FOLDER/capture."""
    path = os.path.join(folder, "scene.yaml")
    with open(path, "w") as f:
        yaml.safe_dump(scene, f)
    subprocess.check_call([goniocam, "render", path, "-o", os.path.join(folder, "capture"), "--quiet"],
                          stdout=subprocess.DEVNULL)
