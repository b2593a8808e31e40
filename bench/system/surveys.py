#!/usr/bin/env python3
"""Photographs and video as drones deliver them, told nothing: what the program makes of them.

  bench/system/surveys.py [--only NAME ...] [--set name=value ...]

| name | what |
|---|---|
| zr10 | `zr10_survey` as it is: its EXIF focal length is 2.4 times too long |
| zr10_focal_R | the same, with a camera.yaml of `model: auto` whose focal length is R times COLMAP's |
| zr10_reverse, zr10_random | the same without EXIF, renamed so that their order is the reverse, or none |
| uav | `uav_nadir_survey` as it is |
| karma | `karma.mp4`, without a calibration |

For each: photographs in the main map, maps, focal length and k1 with standard deviations, horizontal error after Sim3
(against GNSS at the photographs' moments; of the other zr10 runs the root mean square distance from the first, after
alignment), time and memory. The table goes to stdout as Markdown, everything to OUT/surveys.json. Data is looked for in
$DEEPUAV_SHARED/data (default ../shared); what is absent is skipped and named. Needs build/deepuav and Python's standard
library.
"""
import argparse
import bisect
import csv
import json
import math
import os
import random
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "build/deepuav"
COLMAP_FOCAL_PX, COLMAP_K1 = 2754, -0.20
ZR10_SIZE = (2560, 1440)
FOCAL_RATIOS = (0.4, 0.7, 1.5, 3)
PHOTOGRAPH_INTERVAL_S = 3
METRES_PER_DEGREE = 111320


def without_exif(jpeg):
    """The bytes of a JPEG without its APP1 segments."""
    out, at = bytearray(jpeg[:2]), 2
    while at + 4 <= len(jpeg) and jpeg[at] == 0xFF and jpeg[at + 1] != 0xDA:
        end = at + 2 + int.from_bytes(jpeg[at + 2:at + 4], "big")
        if jpeg[at + 1] != 0xE1:
            out += jpeg[at:end]
        at = end
    return bytes(out + jpeg[at:])


def poses(file):
    rows = [line.split() for line in Path(file).read_text().splitlines() if line and not line.startswith("#")]
    return [(float(row[0]), [float(value) for value in row[1:]]) for row in rows]


def main_map(folder):
    """Where the photographs of a run's main map were taken, by number: without EXIF their times are their numbers."""
    main = str(json.loads((folder / "summary.json").read_text())["main_map"])
    rows = [line.split(",") for line in (folder / "frames.csv").read_text().splitlines()[1:]]
    in_main = {int(row[0]) for row in rows if row[3] == main}
    return {round(time): pose[:3] for time, pose in poses(folder / "trajectory.txt") if round(time) in in_main}


def write_positions(file, timed):
    Path(file).write_text("".join(f"{t:.6f} {x:.6f} {y:.6f} {z:.6f} 0 0 0 1\n" for t, (x, y, z) in timed))


def evaluate(truth, estimate, *more):
    done = subprocess.run([PROGRAM, "eval", truth, estimate, "--json", "-", *map(str, more)], capture_output=True, text=True)
    return json.loads(done.stdout) if done.returncode == 0 else None


def gnss_positions(file):
    """Seconds and metres east, north, up of the first fix: over 200 m a plane is good to a millimetre."""
    with open(file) as stream:
        rows = [[float(value) for value in row] for row in list(csv.reader(stream))[1:]]
    _, latitude, longitude, altitude = rows[0]
    east = METRES_PER_DEGREE * math.cos(math.radians(latitude))
    return [(t / 1e6, ((lon - longitude) * east, (lat - latitude) * METRES_PER_DEGREE, alt - altitude))
            for t, lat, lon, alt in rows]


def interpolate(track, time):
    i = bisect.bisect(track, (time,))
    if i == 0 or i == len(track):
        return None
    (t0, a), (t1, b) = track[i - 1], track[i]
    share = (time - t0) / (t1 - t0)
    return tuple(p + share * (q - p) for p, q in zip(a, b))


def error_at_photographs(gnss_file, trajectory, out):
    """Horizontal root mean square error, m, with the offset of the clocks that makes it least."""
    first = evaluate(gnss_file, trajectory, "--search-offset", 5, "--max-gap", PHOTOGRAPH_INTERVAL_S + 1, "--horizontal")
    if not first:
        return None
    track, taken = gnss_positions(gnss_file), [time for time, _ in poses(trajectory)]
    best = None
    for step in range(-20, 21):
        offset = first["time_offset_s"] + 0.05 * step
        truth = [(t, interpolate(track, t + offset)) for t in taken]
        write_positions(out / "gnss.txt", [(t, p) for t, p in truth if p])
        found = evaluate(out / "gnss.txt", trajectory, "--horizontal")
        if found and (best is None or found["ate_m"]["rmse"] < best["ate_m"]["rmse"]):
            best = found
    return best


def calibration(out):
    text = (out / "camera.yaml").read_text()
    number = lambda pattern: next((float(m) for m in re.findall(pattern, text)), None)
    return {"focal_px": number(r"\nfx: (\S+)"), "focal_sigma_px": number(r"fx (\S+) px, k1"),
            "k1": number(r"distortion: \[([^,\]]+)"), "k1_sigma": number(r"k1 (\S+), k2")}


def run(name, dataset, out, arguments, *more):
    folder = out / name
    command = [PROGRAM, "run", dataset, "--out", folder, "--log-level", "warn", *more]
    for assignment in arguments.set:
        command += ["--set", assignment]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if not (folder / "summary.json").is_file():
        return {"name": name, "failure": done.stderr.strip()}
    summary = json.loads((folder / "summary.json").read_text())
    main = next((m["frames"] for m in summary["maps"] if m["id"] == summary["main_map"]), 0)
    return {"name": name, "folder": str(folder), "images": summary["frames"]["images"], "in_main_map": main,
            "maps": len(summary["maps"]), "wall_s": summary["wall_s"], "memory_mb": summary["peak_resident_mb"],
            **calibration(folder)}


def renamed(photographs, order, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for number, index in enumerate(order):
        (folder / f"{number:04}.jpg").write_bytes(without_exif(photographs[index].read_bytes()))
    return folder


def distance_from(first, result, order, scale, out):
    """Of the photographs of a run without EXIF, taken in `order`, from where the first run has them, m."""
    where = dict(zip(range(len(order)), order))
    of_first = poses(Path(first["folder"]) / "keyframes.txt")
    if len(of_first) != len(order):
        return None
    truth = [(float(number), [scale * v for v in of_first[index][1][:3]]) for number, index in where.items()]
    write_positions(out / "first.txt", truth)
    return evaluate(out / "first.txt", Path(result["folder"]) / "trajectory.txt")


def run_zr10(data, arguments, report):
    dataset, out = data / "zr10_survey", arguments.out
    if not dataset.is_dir():
        return report({"name": "zr10", "failure": f"skipped: not in {data}"})
    photographs = sorted((dataset / "images").glob("*.jpg"))
    first = run("zr10", dataset, out, arguments)
    found = "folder" in first and error_at_photographs(dataset / "gps.csv", Path(first["folder"]) / "trajectory.txt", out)
    if found:
        first["error_m"] = found["ate_m"]["rmse"]
    report(first)
    if not found:
        return None
    scale = found["alignment"]["scale"]

    def report_beside(result, order):
        beside = "folder" in result and distance_from(first, result, order, scale, out)
        if beside:
            result["error_m"] = beside["ate_m"]["rmse"]
        report(result)

    in_order = list(range(len(photographs)))
    shuffled = in_order[:]
    random.Random(1).shuffle(shuffled)
    for name, order in (("reverse", in_order[::-1]), ("random", shuffled)):
        report_beside(run(f"zr10_{name}", renamed(photographs, order, out / name), out, arguments), order)
    plain = renamed(photographs, in_order, out / "plain")
    width, height = ZR10_SIZE
    for ratio in FOCAL_RATIOS:
        focal = ratio * COLMAP_FOCAL_PX
        guess = out / f"focal_{ratio}.yaml"
        guess.write_text(f"model: auto\nwidth: {width}\nheight: {height}\nfx: {focal}\nfy: {focal}\n"
                         f"cx: {(width - 1) / 2}\ncy: {(height - 1) / 2}\n")
        report_beside(run(f"zr10_focal_{ratio}", plain, out, arguments, "--camera", guess), in_order)
    return None


def run_uav(data, arguments, report):
    dataset = data / "uav_nadir_survey"
    if not dataset.is_dir():
        return report({"name": "uav", "failure": f"skipped: not in {data}"})
    result = run("uav", dataset, arguments.out, arguments)
    if "folder" in result:
        found = evaluate(dataset, Path(result["folder"]) / "trajectory.txt", "--horizontal")
        result["error_m"] = found["ate_m"]["rmse"] if found else None
    return report(result)


def run_karma(data, arguments, report):
    video = data / "karma/karma.mp4"
    if not video.is_file():
        return report({"name": "karma", "failure": f"skipped: not in {data}"})
    return report(run("karma", video, arguments.out, arguments))


def table_row(result, name, cells):
    """A row of Markdown: photographs and maps, `cells`, time and memory; or why there is none. A cell is a text in which
    {key:form} stands for that value of the result, for nothing where it is not known."""
    if "failure" in result:
        return f"| {name} | {result['failure']} |" + " |" * (len(cells) + 3)

    def fill(field):
        value = result.get(field[1])
        return "" if value is None else format(value, field[2])

    filled = [re.sub(r"{(\w+):([^}]*)}", fill, cell) for cell in cells]
    return " | ".join([f"| {name}", f"{result['in_main_map']} of {result['images']}", str(result["maps"]), *filled,
                       f"{result['wall_s']:.0f}", f"{result['memory_mb']:.0f} |"])


def row(result):
    return table_row(result, result["name"],
                     ["{focal_px:.1f} ({focal_sigma_px:.1f})", "{k1:.3f} ({k1_sigma:.3f})", "{error_m:.2f}"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=["zr10", "uav", "karma"], choices=["zr10", "uav", "karma"])
    parser.add_argument("--set", nargs="*", default=[], help="options passed on, name=value")
    parser.add_argument("--out", type=Path, default=ROOT / "out/surveys")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    data = Path(os.environ.get("DEEPUAV_SHARED", ROOT / "../shared")) / "data"
    results = []

    def report(result):
        results.append(result)
        print(row(result), flush=True)

    print("| | photographs in the main map | maps | focal length, px | k1 | error, m | s | MB |\n|---|---|---|---|---|---|---|---|")
    for name in arguments.only:
        {"zr10": run_zr10, "uav": run_uav, "karma": run_karma}[name](data, arguments, report)
    (arguments.out / "surveys.json").write_text(json.dumps({"command": " ".join(sys.argv), "results": results}, indent=1))


if __name__ == "__main__":
    main()
