#!/usr/bin/env python3
"""Photographs taken sideways from one line: fixes in a row leave open how the map lies about it, a gimbal's angles do not.

  bench/system/gimbal_angles.py [--first-seed N] [--seeds N] [--cache CACHE] [--out OUT]

Renders 17 photographs of 1600x1200 of a village from a line of 120 m, 30 m high, the camera looking to its left and 35
degrees down, into CACHE, and writes DJI's XMP into them: fixes whose error is 1 m in all and 0.3 m of each, up twice that;
angles whose error is 0.7 degrees of tilt and 5 of heading in all and 0.2 of each. Runs `deepuav run` with
  fixes      --use camera,gnss
  angles     --use auto
  turned     the same where the angles are 60 degrees of heading wrong, which the fixes contradict
  disagree   the same where the angles are of an airframe that turns to and fro
and prints a Markdown row each: whether the map came to its place, whether the angles counted, by how many degrees what is up
and what is north in the map are off, what it says of that, and by how far the photographs are off beyond what the mean of
the fixes is, horizontally. Needs build/deepuav and Python's standard library.
"""
import argparse
import json
import math
import random
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench/system"))
from simulated_surveys import ORIGIN_ALTITUDE_M, ORIGIN_DEG, PROGRAM, metres_per_radian, with_xmp  # noqa: E402
from surveys import poses  # noqa: E402

OPTIONS = {"camera.width": 1600, "camera.height": 1200, "camera.fx": 1300, "camera.fy": 1300, "camera.cx": 800,
           "camera.cy": 600, "camera.distortion": "0 0 0 0", "camera.rate_hz": 1, "mount.pitch_deg": -35,
           "course.kind": "waypoints", "course.waypoints": "-60 -60 30; 60 -60 30", "course.yaw_offset_deg": 90,
           "course.speed_m_s": 8, "flight.duration_s": 16, "imu.rate_hz": 20, "sensor.samples": 1}
CAMERA = "model: radial_tangential\ndistortion: [0, 0, 0, 0]\n" + "".join(
    f"{name}: {OPTIONS[f'camera.{name}']}\n" for name in ("width", "height", "fx", "fy", "cx", "cy"))
CASES = {"fixes": "camera,gnss", "angles": "auto", "turned": "auto", "disagree": "auto"}
FIX_MEAN_SIGMA_M, FIX_SIGMA_M, UP_OVER_HORIZONTAL = 1, 0.3, 2
TILT_SIGMA_DEG, HEADING_SIGMA_DEG, ANGLE_SIGMA_DEG = 0.7, 5, 0.2
TURNED_DEG, TO_AND_FRO_DEG = 60, 40


def rotated(q, v):
    """The vector turned by the quaternion (w, x, y, z)."""
    w, *u = q
    t = [2 * (u[1] * v[2] - u[2] * v[1]), 2 * (u[2] * v[0] - u[0] * v[2]), 2 * (u[0] * v[1] - u[1] * v[0])]
    return [v[0] + w * t[0] + u[1] * t[2] - u[2] * t[1], v[1] + w * t[1] + u[2] * t[0] - u[0] * t[2],
            v[2] + w * t[2] + u[0] * t[1] - u[1] * t[0]]


def gimbal_angles_deg(q):
    """Yaw from north over east, pitch up and roll of a camera (x right, y down, z ahead) with that orientation."""
    (e, n, up), right, down = (rotated(q, axis) for axis in ([0, 0, 1], [1, 0, 0], [0, 1, 0]))
    return [math.degrees(a) for a in (math.atan2(e, n), math.asin(max(-1, min(1, up))), math.atan2(-right[2], -down[2]))]


def photographed(flight, folder, case, seed):
    """Writes the photographs with XMP into the folder; the true position and orientation of each."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    generator = random.Random(seed)
    mean = [generator.gauss(0, FIX_MEAN_SIGMA_M) for _ in range(3)]
    off = [generator.gauss(0, sigma) for sigma in (HEADING_SIGMA_DEG, TILT_SIGMA_DEG, TILT_SIGMA_DEG)]
    per_north, per_east = metres_per_radian()
    truth = []
    for line in (flight / "groundtruth_cam0.csv").read_text().splitlines()[1:]:
        time, *values = line.split(",")
        file = flight / f"mav0/cam0/data/{time}.jpg"
        if not file.is_file():
            continue
        pose = [float(value) for value in values[:7]]
        position, orientation = pose[:3], pose[3:]
        east, north, up = (p + m + generator.gauss(0, FIX_SIGMA_M) for p, m in zip(position, mean))
        up = position[2] + UP_OVER_HORIZONTAL * (up - position[2])
        yaw, pitch, roll = (a + o + generator.gauss(0, ANGLE_SIGMA_DEG) for a, o in zip(gimbal_angles_deg(orientation), off))
        yaw += {"turned": TURNED_DEG, "disagree": TO_AND_FRO_DEG * (-1) ** len(truth)}.get(case, 0)
        fields = {"GpsLatitude": f"{ORIGIN_DEG[0] + math.degrees(north / per_north):+.10f}",
                  "GpsLongitude": f"{ORIGIN_DEG[1] + math.degrees(east / per_east):+.10f}",
                  "AbsoluteAltitude": f"{ORIGIN_ALTITUDE_M + up:+.3f}", "RtkFlag": "16", "RtkStdLon": "1", "RtkStdLat": "1",
                  "RtkStdHgt": "2", "GimbalYawDegree": f"{yaw:+.2f}", "GimbalPitchDegree": f"{pitch:+.2f}",
                  "GimbalRollDegree": f"{roll:+.2f}"}
        (folder / f"{len(truth):04}.jpg").write_bytes(with_xmp(file.read_bytes(), fields))
        truth.append((position, orientation))
    (folder / "camera.yaml").write_text(CAMERA)
    return truth


def turns_deg(found, truth):
    """By how much up is off, and north, in the mean of the poses."""
    sums = [[0, 0, 0], [0, 0, 0]]
    for q, true in zip(found, truth):
        back = [true[0], *(-part for part in true[1:])]
        for total, axis in zip(sums, ([0, 0, 1], [0, 1, 0])):  # Of the true world, as the map has it.
            for i, value in enumerate(rotated(q, rotated(back, axis))):
                total[i] += value
    up, north = sums
    return math.degrees(math.atan2(math.hypot(up[0], up[1]), up[2])), math.degrees(math.atan2(-north[0], north[1]))


def measure(case, seed, flight, arguments):
    out = arguments.out / f"{case}-{seed}"
    truth = photographed(flight, out / "photographs", case, seed)
    subprocess.run([PROGRAM, "run", out / "photographs", "--out", out / "run", "--use", CASES[case], "--log-level", "warn"],
                   check=True, stdout=subprocess.DEVNULL)
    summary = json.loads((out / "run/summary.json").read_text())
    gauge = next(a_map["gauge"] for a_map in summary["maps"] if a_map["id"] == summary["main_map"])
    found = poses(out / "run/trajectory.txt")
    result = f"| {case} {seed} | {len(found)} of {len(truth)} | {gauge['kind']} | "
    if gauge["kind"] != "georeferenced":
        return result + "| | | | |"
    of = [truth[round(time)] for time, _ in found]
    orientations = [(pose[6], *pose[3:6]) for _, pose in found]
    tilt, heading = turns_deg(orientations, [orientation for _, orientation in of])
    off = [[pose[axis] - position[axis] for axis in range(2)] for (_, pose), (position, _) in zip(found, of)]
    mean = [sum(axis) / len(off) for axis in zip(*off)]
    rms = math.sqrt(sum(sum((value - m) ** 2 for value, m in zip(each, mean)) for each in off) / len(off))
    return result + (f"{'yes' if gauge['held_by_attitude'] else 'no'} | {tilt:.2f} | {heading:+.2f} | "
                     f"{gauge['turn_sigma_deg']:.2f} | {rms:.3f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--cache", type=Path, default=ROOT / ".cache/photographs")
    parser.add_argument("--out", type=Path, default=ROOT / "out/gimbal_angles")
    arguments = parser.parse_args()
    print("| seed | photographs | map | angles count | up off, deg | north off, deg | said, deg | shape, m |\n"
          "|---|---|---|---|---|---|---|---|")
    for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
        flight = arguments.cache / f"sideways-seed-{seed}"
        command = [PROGRAM, "simulate", "--flight", "survey", "--out", flight, "--seed", seed, "--log-level", "warn"]
        for option, value in {**OPTIONS, "scene.seed": seed}.items():
            command += ["--set", f"{option}={value}"]
        subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)
        for case in CASES:
            print(measure(case, seed, flight, arguments), flush=True)


if __name__ == "__main__":
    main()
