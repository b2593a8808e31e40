#!/usr/bin/env python3
"""The orthophoto of a simulated survey against the true one.

  bench/system/orthophotos.py [--seeds N] [--out DIR] [--set name=value ...]

Renders FLIGHT (`flights/survey.yaml` made larger, a photograph every 1.5 s, 1600x1200, k1 = -0.25), gives the images
as photographs without EXIF and with position fixes of 2 cm to `deepuav run`, told nothing of the lens, exports
orthophoto and DSM and compares them with the truth (`orthophoto_error`). Prints a Markdown table, a row a seed:
photographs in the main map, cells of the orthophoto, displacement in pixels (median, 90th percentile; the median less
a shift of the whole), holes among cells that three photographs show, median error of the DSM, seconds and memory of
the export. Everything goes to OUT. Needs build/deepuav, build/bench/system/orthophoto_error and Python's standard library.
"""
import argparse
import json
import math
import os
import random
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAM, COMPARE = ROOT / "build/deepuav", ROOT / "build/bench/system/orthophoto_error"
CELL_M = 0.05
FIX_SIGMA_M = 0.02
FLIGHT = {
    "course.length_m": 160, "course.width_m": 120, "course.line_spacing_m": 25, "course.height_m": 60,
    "course.speed_m_s": 8, "flight.duration_s": 180, "camera.width": 1600, "camera.height": 1200, "camera.fx": 1300,
    "camera.fy": 1300, "camera.cx": 805, "camera.cy": 595, "camera.distortion": "-0.25 0.08 0 0",
    "camera.rate_hz": 0.6667, "sensor.samples": 2, "imu.rate_hz": 20,
}
ORIGIN = (47.3977, 8.5456, 488)  # as the simulator's gnss.origin_*
SEMI_MAJOR_M, FLATTENING = 6378137.0, 1 / 298.257223563


def geodetic(east, north, up):
    """Latitude, longitude and altitude of metres east, north and up of ORIGIN."""
    lat, lon = (math.radians(angle) for angle in ORIGIN[:2])
    e2 = FLATTENING * (2 - FLATTENING)
    radius = SEMI_MAJOR_M / math.sqrt(1 - e2 * math.sin(lat) ** 2)
    x = (radius + ORIGIN[2]) * math.cos(lat) * math.cos(lon)
    y = (radius + ORIGIN[2]) * math.cos(lat) * math.sin(lon)
    z = (radius * (1 - e2) + ORIGIN[2]) * math.sin(lat)
    x += -math.sin(lon) * east - math.sin(lat) * math.cos(lon) * north + math.cos(lat) * math.cos(lon) * up
    y += math.cos(lon) * east - math.sin(lat) * math.sin(lon) * north + math.cos(lat) * math.sin(lon) * up
    z += math.cos(lat) * north + math.sin(lat) * up
    lon, across, lat = math.atan2(y, x), math.hypot(x, y), math.atan2(z, math.hypot(x, y))
    for _ in range(8):
        radius = SEMI_MAJOR_M / math.sqrt(1 - e2 * math.sin(lat) ** 2)
        altitude = across / math.cos(lat) - radius
        lat = math.atan2(z, across * (1 - e2 * radius / (radius + altitude)))
    return math.degrees(lat), math.degrees(lon), altitude


def simulate(seed, out):
    command = [PROGRAM, "simulate", "--flight", "survey", "--out", out, "--seed", seed, "--orthophoto", CELL_M,
               "--log-level", "warn"]
    for name, value in FLIGHT.items():
        command += ["--set", f"{name}={value}"]
    subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)


def as_photographs(simulated, folder, seed):
    """Photographs that know no time but their order, a second each, and fixes at these times."""
    images = folder / "images"
    shutil.rmtree(folder, ignore_errors=True)
    images.mkdir(parents=True)
    noise = random.Random(seed)
    lines = ["time [us],latitude [deg],longitude [deg],altitude [m]"]
    rows = [line.split(",") for line in (simulated / "groundtruth_cam0.csv").read_text().splitlines()[1:]]
    for number, row in enumerate(rows):
        shutil.copy(simulated / f"mav0/cam0/data/{row[0]}.jpg", images / f"{number:04}.jpg")
        place = geodetic(*(float(value) + noise.gauss(0, FIX_SIGMA_M) for value in row[1:4]))
        lines.append(f"{number * 1000000}," + ",".join(f"{value:.10f}" for value in place))
    (folder / "gps.csv").write_text("\n".join(lines) + "\n")
    return folder


def call(*command):
    """Output, seconds and peak memory in MB."""
    start = time.monotonic()
    process = subprocess.Popen([str(part) for part in command], stdout=subprocess.PIPE, text=True)
    text = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit(f"{' '.join(map(str, command))}: status {status}")
    return text, time.monotonic() - start, usage.ru_maxrss / 1024


def measure(seed, arguments):
    out = arguments.out / f"seed-{seed}"
    simulate(seed, out / "simulated")
    photographs = as_photographs(out / "simulated", out / "photographs", seed)
    more = [part for assignment in arguments.set for part in ("--set", assignment)]
    call(PROGRAM, "run", photographs, "--out", out / "run", "--log-level", "warn", *more)
    summary = json.loads((out / "run/summary.json").read_text())
    main = next(one["frames"] for one in summary["maps"] if one["id"] == summary["main_map"])
    map_file = out / "run/map.deepuav"
    number = summary["main_map"]
    _, wall_s, memory_mb = call(PROGRAM, "map", "export", map_file, "--format", "orthophoto", "--resolution", CELL_M,
                                "--map", number, "--out", out / "orthophoto.tif")
    call(PROGRAM, "map", "export", map_file, "--format", "dsm", "--map", number, "--out", out / "dsm.tif")
    text, _, _ = call(COMPARE, map_file, out / "orthophoto.tif", out / "dsm.tif", out / "simulated/orthophoto.tif",
                      out / "simulated/dsm.tif")
    return {"seed": seed, "images": summary["frames"]["images"], "in_main_map": main, "wall_s": wall_s,
            "memory_mb": memory_mb, **json.loads(text)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--out", type=Path, default=ROOT / "out/orthophotos")
    parser.add_argument("--set", nargs="*", default=[], help="options passed on to run, name=value")
    arguments = parser.parse_args()
    print("| seed | photographs | patches found | displacement, px | less a shift | holes | DSM, m | s | MB |\n"
          "|---|---|---|---|---|---|---|---|---|")
    results = []
    for seed in range(1, arguments.seeds + 1):
        result = measure(seed, arguments)
        results.append(result)
        print(f"| {seed} | {result['in_main_map']} of {result['images']} | {result['found']} of {result['patches']} | "
              f"{result['median_px']} ({result['p90_px']}) | {result['median_less_shift_px']} "
              f"({result['p90_less_shift_px']}) | {result['holes']} of {result['seen_by_three']} | "
              f"{result['median_height_error_m']} | {result['wall_s']:.0f} | {result['memory_mb']:.0f} |", flush=True)
    (arguments.out / "orthophotos.json").write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
