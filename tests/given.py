"""calibration.yaml from the truth of a rendered capture: what somebody else's calibration would say."""
import cv2
import numpy as np

# The scenes' default sensor: electrons a unit of radiance and second, DN an electron, black and white.
FULL_SCALES = 2.5e7 * 0.08 / (4095 - 128)


def lights(truth):
    for light in truth["lights"]:
        known = {"name": light["name"], "frame": "world"}
        if light["kind"] == "distant":
            far2 = np.dot(light["position"], light["position"])  # truth tells it as a point far away
            known.update(direction=light["direction"], irradiance=[FULL_SCALES * x / far2 for x in light["intensity"]])
        else:
            known.update(position=light["position"], intensity=[FULL_SCALES * x for x in light["intensity"]])
        yield {k: [float(x) for x in v] if isinstance(v, list) else v for k, v in known.items()}


def sample(truth):
    s = truth["sample"]
    known = {"shape": s["kind"], "center": s["center"], "radius": s["radius"]}
    if s["kind"] == "cylinder":
        known.update(axis=s["axis"], height=s["length"])
    return known


def shots(truth):
    for s in truth["shots"]:
        rotation = cv2.Rodrigues(np.array(s["R"]))[0][:, 0]
        yield {"name": s["exposures"][0]["file"], "camera": "c", "light": truth["lights"][s["light"]]["name"],
               "rotation": [float(x) for x in rotation], "translation": s["t"], "power": s["light_jitter"]}


def calibration(truth):
    """Without sigmas: all is known."""
    c = truth["camera"]
    camera = {"name": "c", "width": c["width"], "height": c["height"], "focal": [c["fx"], c["fy"]],
              "center": [c["cx"], c["cy"]], "distortion": c["dist"]}
    return {"goniocam": 1, "cameras": [camera], "shots": list(shots(truth)), "lights": list(lights(truth)),
            "sample": sample(truth)}
