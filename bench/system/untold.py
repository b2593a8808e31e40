#!/usr/bin/env python3
"""Flights and sequences whose lens and shutter nobody told, beside the same calibrated: what not knowing them costs.

  bench/system/untold.py [--only NAME ...] [--shutters global rolling] [--first-seed N] [--seeds N] [--frames N]
                         [--set name=value ...]

Flights of flights/ are rendered (into CACHE, where they stay for the next time) with a lens of k1 = -0.28, with all rows
read at once or in 20 ms. Each is run as calibrated, and told but a focal length 30 % too long (`model: auto`) and no
readout; so are the real sequences. For each: ATE after Sim3 over the frames of the largest map as calibrated and untold,
frames there and maps untold, by how much the focal length is off in %, how far the lens has its rays from where the true
one has them (px, root mean square over the image after the mean shift), the readout found in ms. The table goes to stdout
as Markdown, everything to OUT/untold.json. Constants are chosen on seeds 4 and up (--first-seed 4), and
reported on 1 to 3. Needs build/deepuav and Python's standard library.
"""
import argparse
import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench/system"))
from surveys import evaluate  # noqa: E402

PROGRAM = ROOT / "build/deepuav"
FLIGHTS = ["turns", "orbit", "traffic", "river", "survey", "climb", "forest"]
SEQUENCES = ["euroc_mh01_excerpt", "7scenes_redkitchen", "kitti07_excerpt"]
LENS = {"camera.width": 752, "camera.height": 480, "camera.fx": 460, "camera.fy": 460, "camera.cx": 381,
        "camera.cy": 236, "camera.distortion": "-0.28 0.08 0 0", "camera.rate_hz": 10}
READOUT_S = {"global": 0, "rolling": 0.02}
FOCAL_RATIO = 1.3


def rendered(name, shutter, seed, arguments):
    folder = arguments.cache / f"{name}-{shutter}-{seed}-{arguments.frames}"
    if (folder / "complete").is_file():
        return folder
    command = [PROGRAM, "simulate", "--flight", name, "--seed", seed, "--out", folder, "--frames", arguments.frames,
               "--log-level", "warn"]
    for option, value in {**LENS, "sensor.rolling_shutter_readout_s": READOUT_S[shutter]}.items():
        command += ["--set", f"{option}={value}"]
    subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)
    (folder / "complete").touch()
    return folder


def lens_of(text):
    """{field: number or numbers} of a camera.yaml, or of the `camera.yaml` that a run writes."""
    values = {}
    for field in ("width", "height", "fx", "fy", "cx", "cy", "readout_ms"):
        found = re.search(rf"^{field}: (\S+)", text, re.MULTILINE)
        values[field] = float(found.group(1)) if found else 0.0
    found = re.search(r"^distortion: \[([^]]*)\]", text, re.MULTILINE)
    values["distortion"] = [float(value) for value in found.group(1).split(",")] if found and found.group(1).strip() else []
    return values


def run(dataset, out, arguments, *more):
    """The summary, with the lens as `lens`; or why there is none as `failure`."""
    command = [PROGRAM, "run", dataset, "--out", out, "--use", "camera", "--log-level", "warn", *more]
    for assignment in arguments.set:
        command += ["--set", assignment]
    (out / "summary.json").unlink(missing_ok=True)
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if not (out / "summary.json").is_file():
        return {"failure": done.stderr.strip()}
    return {**json.loads((out / "summary.json").read_text()), "lens": lens_of((out / "camera.yaml").read_text())}


def undistorted(lens, x, y):
    """The ray of a pixel as (x, y) at distance 1, by fixed-point iterations of Brown's model."""
    k1, k2, p1, p2 = (lens["distortion"] + [0, 0, 0, 0])[:4]
    xd, yd = (x - lens["cx"]) / lens["fx"], (y - lens["cy"]) / lens["fy"]
    u, v = xd, yd
    for _ in range(50):
        r2 = u * u + v * v
        radial = 1 + r2 * (k1 + k2 * r2)
        u, v = ((xd - 2 * p1 * u * v - p2 * (r2 + 2 * u * u)) / radial,
                (yd - p1 * (r2 + 2 * v * v) - 2 * p2 * u * v) / radial)
    return u, v


def lens_error_px(true, found):
    """Root mean square over the image of the angle between true and found rays, in pixels at the middle, after the
    turn of the camera that makes it least (to first order the mean shift)."""
    shifts = []
    for i in range(9):
        for j in range(7):
            x, y = true["width"] * (i + 0.5) / 9, true["height"] * (j + 0.5) / 7
            (u, v), (s, t) = undistorted(true, x, y), undistorted(found, x, y)
            shifts.append((true["fx"] * (s - u), true["fx"] * (t - v)))
    mean = [sum(shift[axis] for shift in shifts) / len(shifts) for axis in (0, 1)]
    return math.sqrt(sum((a - mean[0]) ** 2 + (b - mean[1]) ** 2 for a, b in shifts) / len(shifts))


def error_m(truth, out):
    found = evaluate(truth, out / "trajectory.txt")
    return found["ate_m"]["rmse"] if found else None


def compare(name, dataset, truth, arguments):
    """A row: the run as calibrated and the run that is told next to nothing."""
    told_out, untold_out = arguments.out / name / "told", arguments.out / name / "untold"
    told = run(dataset, told_out, arguments)
    if "failure" in told:
        return {"name": name, "failure": told["failure"]}
    true = told["lens"]
    guess = arguments.out / name / "guess.yaml"
    focal = FOCAL_RATIO * true["fx"]
    guess.write_text(f"model: auto\nwidth: {true['width']:.0f}\nheight: {true['height']:.0f}\nfx: {focal}\nfy: {focal}\n"
                     f"cx: {(true['width'] - 1) / 2}\ncy: {(true['height'] - 1) / 2}\n")
    untold = run(dataset, untold_out, arguments, "--camera", guess)
    if "failure" in untold:
        return {"name": name, "failure": untold["failure"]}
    found = untold["lens"]
    main = next((m["frames"] for m in untold["maps"] if m["id"] == untold["main_map"]), 0)
    return {"name": name, "told_m": error_m(truth, told_out), "untold_m": error_m(truth, untold_out), "frames": main,
            "images": untold["frames"]["images"], "maps": len(untold["maps"]), "focal": 100 * (found["fx"] / true["fx"] - 1),
            "lens_px": lens_error_px(true, found), "readout_ms": found["readout_ms"]}


def row(result):
    if "failure" in result:
        return f"| {result['name']} | {result['failure']} | | | | | |"
    number = lambda value: "" if value is None else f"{value:.4f}"
    return (f"| {result['name']} | {number(result['told_m'])} | {number(result['untold_m'])} | {result['frames']} of "
            f"{result['images']}, {result['maps']} | {result['focal']:+.2f} | {result['lens_px']:.2f} | {result['readout_ms']:.1f} |")


def cases(arguments):
    """(name, dataset, truth) of each, rendered when its turn comes."""
    data = Path(os.environ.get("DEEPUAV_SHARED", ROOT / "../shared")) / "data"
    for name in arguments.only:
        if name in FLIGHTS:
            for shutter in arguments.shutters:
                for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
                    folder = rendered(name, shutter, seed, arguments)
                    yield f"{name}-{shutter}-{seed}", folder, folder
        elif (data / name).is_dir():
            yield name, data / name, data / name
        else:
            print(f"| {name} | skipped: not in {data} | | | | | |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = SEQUENCES + FLIGHTS
    parser.add_argument("--only", nargs="*", default=names, choices=names, metavar="NAME")
    parser.add_argument("--shutters", nargs="*", default=list(READOUT_S), choices=list(READOUT_S))
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--set", nargs="*", default=[], help="options passed on, name=value")
    parser.add_argument("--cache", type=Path, default=ROOT / ".cache/untold")
    parser.add_argument("--out", type=Path, default=ROOT / "out/untold")
    arguments = parser.parse_args()
    results = []
    print("| | calibrated, m | untold, m | frames, maps | focal length, % | lens, px | readout, ms |\n|---|---|---|---|---|---|---|")
    for name, dataset, truth in cases(arguments):
        results.append(compare(name, dataset, truth, arguments))
        print(row(results[-1]), flush=True)
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "untold.json").write_text(json.dumps({"command": " ".join(sys.argv), "results": results}, indent=1))


if __name__ == "__main__":
    main()
