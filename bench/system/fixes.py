#!/usr/bin/env python3
"""How wrong position fixes may be: simulated flights run with fixes that are spoofed, missing or badly stated.

  bench/system/fixes.py [--only NAME ...] [--first-seed N] [--seeds N] [--rate HZ] [--use SENSORS] [--out DIR]

Renders each flight as flights.py does and runs it with its fixes
  clean     as they are
  spoofed   moved by 30 m to the east for 15 s in the middle of the flight
  outliers  one in ten moved by 20 m in a direction of its own
  gap       none in the middle third
  boastful  with standard deviations stated five times too small
The table (errors of all frames against the truth, unaligned, and the same without what the place of the whole is off,
so that scale and level count) goes to stdout as Markdown, everything to OUT/fixes.json. Needs build/deepuav.
"""
import argparse
import csv
import json
import math
import random
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench/system"))
from flights import DEEPUAV, render, spread  # noqa: E402
from run import processor  # noqa: E402

FIXES = "mav0/gps0/data.csv"
LATITUDE, LONGITUDE, FIRST_SIGMA = 1, 2, 4
METRES_PER_DEGREE = 111_320
SPOOFED_M, SPOOFED_S = 30, 15
OUTLIER_M, OUTLIER_EVERY = 20, 10
BOAST = 5


def moved(row, east_m, north_m):
    row = list(row)
    latitude = float(row[LATITUDE])
    row[LATITUDE] = f"{latitude + north_m / METRES_PER_DEGREE:.10f}"
    row[LONGITUDE] = f"{float(row[LONGITUDE]) + east_m / METRES_PER_DEGREE / math.cos(math.radians(latitude)):.10f}"
    return row


def spoofed(rows):
    middle_ns = (int(rows[0][0]) + int(rows[-1][0])) // 2
    return [moved(row, SPOOFED_M, 0) if abs(int(row[0]) - middle_ns) < SPOOFED_S / 2 * 1e9 else row for row in rows]


def outliers(rows):
    source = random.Random(1)
    angles = [source.uniform(0, 2 * math.pi) for _ in rows]
    return [moved(row, OUTLIER_M * math.cos(angle), OUTLIER_M * math.sin(angle)) if i % OUTLIER_EVERY == 0 else row
            for i, (row, angle) in enumerate(zip(rows, angles))]


def boastful(rows):
    return [row[:FIRST_SIGMA] + [f"{float(sigma) / BOAST:.4f}" for sigma in row[FIRST_SIGMA:]] for row in rows]


VARIANTS = {"clean": lambda rows: rows, "spoofed": spoofed, "outliers": outliers,
            "gap": lambda rows: rows[:len(rows) // 3] + rows[2 * len(rows) // 3:], "boastful": boastful}


def with_fixes(dataset, change, folder):
    """The dataset, in links, with other fixes."""
    shutil.rmtree(folder, ignore_errors=True)
    for file in sorted(dataset.rglob("*")):
        if file.is_file() and "/data/" not in file.as_posix():
            link = folder / file.relative_to(dataset)
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(file.resolve())
    (folder / "mav0/cam0/data").symlink_to((dataset / "mav0/cam0/data").resolve())
    header, *rows = list(csv.reader((dataset / FIXES).open()))
    (folder / FIXES).unlink()
    with (folder / FIXES).open("w", newline="") as stream:
        csv.writer(stream).writerows([header] + change(rows))
    return folder


def error(dataset, trajectory, align):
    done = subprocess.run([DEEPUAV, "eval", dataset, trajectory, "--align", align, "--json", "-"], check=True,
                          capture_output=True, text=True)
    return json.loads(done.stdout)["ate_m"]["rmse"]


def run_once(name, seed, variant, arguments):
    dataset, _ = render(name, seed, arguments)
    changed = with_fixes(dataset, VARIANTS[variant], arguments.out / f"{name}-{seed}-{variant}" / "dataset")
    out = changed.parent / "run"
    subprocess.run([DEEPUAV, "run", changed, "--out", out, "--use", arguments.use, "--log-level", "error"], check=True,
                   stdout=subprocess.DEVNULL)
    gauge = json.loads((out / "summary.json").read_text())["maps"][0]["gauge"]
    result = {"seed": seed, "gauge": gauge, "unaligned": error(dataset, out / "trajectory.txt", "none"),
              "yaw": error(dataset, out / "trajectory.txt", "yaw")}
    if gauge["kind"] != "georeferenced":
        result["unaligned"] = math.nan
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=["traffic", "orbit", "rain"], help="names of flights")
    parser.add_argument("--variants", nargs="*", default=list(VARIANTS), choices=list(VARIANTS))
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=1, help="how many seeds")
    parser.add_argument("--rate", type=float, default=10, help="pictures a second")
    parser.add_argument("--use", default="auto", help="sensors, as of the run")
    parser.add_argument("--cache", type=Path, default=ROOT / ".cache/flights")
    parser.add_argument("--out", type=Path, default=ROOT / "out/fixes")
    arguments = parser.parse_args()
    arguments.frames = -1
    arguments.cache = arguments.cache / f"{arguments.rate:g}-hz"
    arguments.out.mkdir(parents=True, exist_ok=True)
    results = {"machine": processor(), "command": " ".join(sys.argv), "flights": {}}
    print(f"Machine: {results['machine']}\n")
    print("| flight | fixes | unaligned, m | over clean | aligned by place and heading, m | fixes used, % |")
    print("|" + 6 * "---|")
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    for name in arguments.only:
        of_flight = results["flights"][name] = {}
        for variant in arguments.variants:
            runs = of_flight[variant] = [run_once(name, seed, variant, arguments) for seed in seeds]
            clean = of_flight.get("clean", [])
            ratio = statistics.median(run["unaligned"] / base["unaligned"] for run, base in zip(runs, clean)) if clean else math.nan
            used = statistics.median(100 * run["gauge"].get("fixes", {"used": 0})["used"] /
                                     max(run["gauge"].get("fixes", {"on_path": 1})["on_path"], 1) for run in runs)
            print(f"| `{name}` | {variant} | {spread([run['unaligned'] for run in runs], '.2f')} | {ratio:.2f} | "
                  f"{spread([run['yaw'] for run in runs], '.3f')} | {used:.0f} |", flush=True)
            (arguments.out / "fixes.json").write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
