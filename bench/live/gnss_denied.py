#!/usr/bin/env python3
"""Where an autopilot is told to be, on Earth, after its position fixes ended: on a first flight, without a map.

  gnss_denied.py DEEPUAV [--flights NAME ...] [--first-seed N] [--seeds N] [--share 0.5] [--no-imu] [--set name=value ...]

Each flight is rendered at 10 images a second (flights.py) and played at its own pace by `deepuav live --mavlink`, with its
inertial samples, and its fixes up to a share of its length. What comes as ODOMETRY, from the origin that is told, is compared
with the truth without any alignment but one of clocks, which is found on the part with fixes. Metres, horizontally /
vertically: how far the mean of the fixes is off, which no place by them can do without, as most of their error stays the same
for a minute; rms with fixes, from when a place was told; without, the rest of the flight, and what `pose_covariance` states
there, horizontally; at the flight's end; how often the place was told anew or a loop moved it.
"""
import argparse
import csv
import math
import os
import statistics
import subprocess
import sys
import tempfile
from bisect import bisect_left
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / ".deps/pymavlink"), str(ROOT / "bench/system")]
import autopilot_test
import flights
from earth import local

RATE_HZ = 10
CLOCK_STEP_S, CLOCK_RANGE_S = 0.02, 3


def rows(file):
    with file.open(newline="") as lines:
        return [[float(field) for field in row] for row in csv.reader(lines) if row and not row[0].startswith("#")]


def image_times_ns(dataset):
    lines = (dataset / "mav0/cam0/data.csv").read_text().splitlines()
    return [int(line.split(",")[0]) for line in lines if line and not line.startswith("#")]


class Truth:
    """Of the body, east, north, up of the flight's origin; seconds from its first image."""

    def __init__(self, dataset):
        table = rows(dataset / "mav0/state_groundtruth_estimate0/data.csv")
        image_times = image_times_ns(dataset)
        self.begin_ns, self.length_s = image_times[0], 1e-9 * (image_times[-1] - image_times[0])
        self.times = [1e-9 * (row[0] - self.begin_ns) for row in table]
        self.positions = [tuple(row[1:4]) for row in table]
        values = dict(line.split("#")[0].strip().split(": ", 1) for line in self.section(dataset, "gnss") if ": " in line)
        self.origin = tuple(float(values[f"origin_{name}"]) for name in ("latitude_deg", "longitude_deg", "altitude_m"))

    @staticmethod
    def section(dataset, name):
        lines = (dataset / "simulation.yaml").read_text().splitlines()
        begin = lines.index(f"{name}:") + 1
        end = next((i for i in range(begin, len(lines)) if not lines[i].startswith(" ")), len(lines))
        return lines[begin:end]

    def at(self, t):
        after = bisect_left(self.times, t)
        if not 0 < after < len(self.times):
            return None
        t0, t1 = self.times[after - 1], self.times[after]
        share = (t - t0) / (t1 - t0)
        return tuple(a + share * (b - a) for a, b in zip(self.positions[after - 1], self.positions[after]))


def with_fixes_until(dataset, folder, seconds, begin_ns, imu):
    """The dataset, its fixes cut off."""
    copy = folder / "dataset"
    (copy / "mav0/gps0").mkdir(parents=True)
    for part in (dataset / "mav0").iterdir():
        if part.name == "gps0" or (part.name == "imu0" and not imu):
            continue
        (copy / "mav0" / part.name).symlink_to(part.resolve())
    (copy / "mav0/gps0/sensor.yaml").symlink_to((dataset / "mav0/gps0/sensor.yaml").resolve())
    kept = [line for line in (dataset / "mav0/gps0/data.csv").read_text().splitlines()
            if line.startswith("#") or 1e-9 * (int(line.split(",")[0]) - begin_ns) <= seconds]
    (copy / "mav0/gps0/data.csv").write_text("\n".join(kept) + "\n")
    return copy


def listen(arguments, dataset, out):
    """What is told of the flight: (seconds of the autopilot, message), the origin, texts."""
    autopilot = autopilot_test.Autopilot()
    command = [arguments.deepuav, "live", dataset, "--clock", "stream", "--out", out, "--save-every", "0", "--mavlink",
               autopilot.address, "--mount", "dataset", "--log-level", "info"]
    for assignment in arguments.set:
        command += ["--set", assignment]
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise SystemExit(f"gnss_denied.py: {' '.join(map(str, command))} failed: {done.stderr}")
    told = [line.split("info: ")[-1] for line in done.stderr.splitlines() if "on Earth" in line or "has metres" in line]
    origins = [message for _, _, message in autopilot.of("SET_GPS_GLOBAL_ORIGIN")]
    odometry = [(1e-6 * message.time_usec, message) for _, _, message in autopilot.of("ODOMETRY")]
    autopilot.close()
    origin = (origins[-1].latitude / 1e7, origins[-1].longitude / 1e7, origins[-1].altitude / 1e3) if origins else None
    # Before a place was told positions are of the metric map alone.
    since = [arrived for arrived, _, _ in autopilot.of("SET_GPS_GLOBAL_ORIGIN")][:1]
    placed = [(1e-6 * message.time_usec, message) for arrived, _, message in autopilot.of("ODOMETRY")
              if since and arrived >= since[0]]
    return odometry, placed, origin, told


def errors(placed, origin, truth, clock_s):
    """(seconds, horizontally, up, horizontally as stated) by message."""
    shift = local(truth.origin, origin)
    found = []
    for t, message in placed:
        at = truth.at(t - clock_s)
        if at is None:
            continue
        east, north, up = message.y + shift[0], message.x + shift[1], -message.z + shift[2]
        stated = math.sqrt(message.pose_covariance[0] + message.pose_covariance[6])
        found.append((t - clock_s, math.hypot(east - at[0], north - at[1]), up - at[2], stated))
    return found


def clock_of(placed, origin, truth, end_s, about_s):
    """What is to be taken from the autopilot's times; by the part with fixes."""
    steps = int(CLOCK_RANGE_S / CLOCK_STEP_S)
    best = None
    for i in range(-steps, steps + 1):
        clock_s = about_s + i * CLOCK_STEP_S
        known = [horizontal for t, horizontal, *_ in errors(placed[::4], origin, truth, clock_s) if t <= end_s]
        if known and (best is None or statistics.median(known) < best[0]):
            best = statistics.median(known), clock_s
    return best[1] if best else None


def rms(values):
    return math.sqrt(sum(value**2 for value in values) / len(values)) if values else math.nan


def pair(part):
    return f"{rms([one[1] for one in part]):.2f} / {rms([one[2] for one in part]):.2f}" if part else "-"


def mean_error_of_fixes(dataset, truth, end_s):
    """Horizontally and up: what the errors that last leave of the mean."""
    apart = []
    for row in rows(dataset / "mav0/gps0/data.csv"):
        at = truth.at(1e-9 * (row[0] - truth.begin_ns))
        if at and 1e-9 * (row[0] - truth.begin_ns) <= end_s:
            apart.append([a - b for a, b in zip(local(truth.origin, row[1:4]), at)])
    east, north, up = (statistics.mean(axis) for axis in zip(*apart))
    return f"{math.hypot(east, north):.2f} / {abs(up):.2f}"


def fly(name, seed, arguments):
    dataset, _ = flights.render(name, seed, arguments)
    truth = Truth(dataset)
    end_s = arguments.share * truth.length_s
    with tempfile.TemporaryDirectory(prefix="deepuav-gnss-denied-") as folder:
        folder = Path(folder)
        copy = with_fixes_until(dataset, folder, end_s, truth.begin_ns, not arguments.no_imu)
        odometry, placed, origin, told = listen(arguments, copy, folder / "out")
    for line in told:
        print(f"  {line}", file=sys.stderr)
    head = f"| `{name}`, {seed} | {truth.length_s:.0f} s | {mean_error_of_fixes(dataset, truth, end_s)} |"
    if not placed:
        return f"{head} no place | | | | | |"
    # The last odometry is of about the last image.
    clock_s = clock_of(placed, origin, truth, end_s, odometry[-1][0] - truth.length_s)
    if clock_s is None:
        return f"{head} after the fixes | | | | | |"
    found = errors(placed, origin, truth, clock_s)
    known, denied = [e for e in found if e[0] <= end_s], [e for e in found if e[0] > end_s]
    changes = sum(a.reset_counter != b.reset_counter for (_, a), (_, b) in zip(placed, placed[1:]))
    stated = f"{rms([one[3] for one in denied]):.2f}" if denied else "-"
    return f"{head} {found[0][0]:.0f} s | {pair(known)} | {pair(denied)} | {stated} | {pair(denied[-1:])} | {changes} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("deepuav", type=os.path.abspath)
    parser.add_argument("--flights", nargs="+", default=["survey", "orbit", "river"])
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--share", type=float, default=0.5, help="of the flight, with fixes")
    parser.add_argument("--no-imu", action="store_true")
    parser.add_argument("--set", action="append", default=[], metavar="name=value")
    parser.add_argument("--cache", type=Path, default=ROOT / ".cache/flights")
    arguments = parser.parse_args()
    arguments.rate, arguments.frames = RATE_HZ, -1
    titles = ["flight, seed", "length", "mean of the fixes", "place told after", "with fixes", "without", "stated",
              "at the end", "changes"]
    print(f"| {' | '.join(titles)} |\n{'|---' * len(titles)}|")
    for name in arguments.flights:
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
            print(fly(name, seed, arguments), flush=True)


if __name__ == "__main__":
    sys.exit(main())
