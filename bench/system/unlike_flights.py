#!/usr/bin/env python3
"""Flights unlike those of flights/, which chose no constant: renders them, runs the program over them, prints a table.

  bench/system/unlike_flights.py [--only NAME ...] [--first-seed N] [--seeds N] [--use LIST ...] [--set name=value ...]

Each is a flight of flights/ with other options (FLIGHTS), rendered once a seed into CACHE, where it stays for the next
time: round a town and back, a racing drone whose camera looks up into clouds, up and down along a tower, by a long lens,
low over grass, a fixed wing, backwards up and away, hovering while turning slowly, quickly through a hall, along a river
from above, in gusts, and up a spiral. For each and each --use (as of `deepuav run`; default: camera, auto): frames of
the largest map and of all, maps, ATE after Sim3 of that map and its farthest frame; after SE3 where the map is metric.
The table goes to stdout as Markdown, everything to OUT/unlike_flights.json. Needs build/deepuav and Python's standard
library.
"""
import argparse
import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench/system"))
from surveys import evaluate  # noqa: E402

PROGRAM = ROOT / "build/deepuav"
FLIGHTS = {
    "tour": ("orbit", {
        "flight.scene": "town", "course.kind": "waypoints", "course.speed_m_s": 10, "course.acceleration_m_s2": 2.5,
        "course.waypoints": "-120 -100 40; 120 -100 40; 130 90 35; -110 110 45; -120 -110 40; 100 -105 40",
        "mount.pitch_deg": -30, "camera.rate_hz": 5, "flight.duration_s": 120}),
    "fpv": ("forest", {
        "course.kind": "waypoints", "course.speed_m_s": 9, "course.acceleration_m_s2": 6, "flight.duration_s": 45,
        "course.waypoints": "-100 -20 4; -40 10 5; 0 -30 4; 50 -10 6; 60 50 5; 0 60 4; -50 30 5; -90 -10 4",
        "mount.pitch_deg": 15, "camera.rate_hz": 20, "attitude.gimbal": "false", "sensor.samples": 4}),
    "mast": ("takeoff", {
        "flight.scene": "town", "course.waypoints": "-30 -30 2; -30 -30 45; -27 -33 45; -27 -33 3",
        "course.speed_m_s": 2, "mount.pitch_deg": 0, "camera.rate_hz": 5, "flight.duration_s": 80}),
    "tele": ("orbit", {
        "flight.scene": "town", "course.radius_m": 110, "course.height_m": 90, "course.speed_m_s": 9,
        "course.laps": 1.05, "camera.fx": 2000, "camera.fy": 2000, "mount.pitch_deg": -40, "camera.rate_hz": 5,
        "flight.duration_s": 90}),
    "lowgrass": ("survey", {
        "flight.scene": "countryside", "course.kind": "waypoints", "course.clearance_m": 1, "course.speed_m_s": 5,
        "course.waypoints": "-120 0 4; 0 30 4; 100 -20 5; 60 -60 4; -60 -40 4", "camera.rate_hz": 10,
        "flight.duration_s": 60}),
    "wing": ("survey", {
        "flight.scene": "countryside", "course.kind": "circuit", "course.length_m": 500, "course.width_m": 250,
        "course.height_m": 100, "course.speed_m_s": 18, "course.acceleration_m_s2": 5, "course.laps": 1.1,
        "camera.rate_hz": 4, "flight.duration_s": 110, "attitude.gimbal": "false"}),
    "dronie": ("takeoff", {
        "flight.scene": "village", "course.waypoints": "-20 0 3; -100 20 30; -200 60 60", "course.clearance_m": 0.5,
        "course.speed_m_s": 5, "course.yaw": "course", "course.yaw_offset_deg": 180, "mount.pitch_deg": -20,
        "camera.rate_hz": 10, "flight.duration_s": 60}),
    "panorama": ("spin", {
        "course.waypoints": "-20 -30 30 15 360; -18 -30 30 3 -180; 50 0 32 8 200; 20 40 30",
        "course.yaw_rate_deg_s": 40, "camera.rate_hz": 10, "flight.duration_s": 75}),
    "indoor": ("rooms", {
        "course.waypoints": "-6 -3 1.5; 5 -3.5 1.6; 6 3 1.4; -3 3.5 1.7; -6 -3 1.2; 0 0 1.5; 5 -3 1.5",
        "course.speed_m_s": 2.5, "course.acceleration_m_s2": 4, "mount.pitch_deg": 0, "camera.rate_hz": 11,
        "attitude.gimbal": "false", "flight.duration_s": 40}),
    "riverside": ("river", {"course.height_m": 60, "mount.pitch_deg": -60, "camera.rate_hz": 5}),
    "gust": ("survey", {
        "flight.scene": "village", "wind.jitter_angle_deg": 4, "wind.jitter_position_m": 0.3,
        "wind.jitter_low_hz": 0.3, "wind.jitter_high_hz": 3, "camera.rate_hz": 5, "flight.duration_s": 70,
        "attitude.gimbal": "false", "sensor.samples": 3}),
    "spiral": ("climb", {
        "flight.scene": "town", "course.radius_m": 45, "course.top_height_m": 60, "mount.pitch_deg": -25,
        "camera.rate_hz": 5, "course.yaw": "center", "flight.duration_s": 90}),
}


def rendered(name, seed, cache):
    folder = cache / f"{name}-{seed}"
    base, options = FLIGHTS[name]
    command = [PROGRAM, "simulate", "--flight", base, "--seed", seed, "--out", folder, "--log-level", "warn"]
    for option, value in options.items():
        command += ["--set", f"{option}={value}"]
    subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)
    return folder


def error(dataset, out, align):
    """{"rmse": m, "max": m}; None where nothing was located."""
    found = evaluate(dataset, out / "trajectory.txt", "--align", align)
    return found["ate_m"] if found else None


def run(name, seed, use, arguments):
    dataset = rendered(name, seed, arguments.cache)
    out = arguments.out / f"{name}-{seed}-{use.replace(',', '-')}"
    command = [PROGRAM, "run", dataset, "--out", out, "--use", use, "--log-level", "warn"]
    for assignment in arguments.set:
        command += ["--set", assignment]
    (out / "summary.json").unlink(missing_ok=True)
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if not (out / "summary.json").is_file():
        return {"name": f"{name} {seed}", "use": use, "failure": done.stderr.strip()}
    summary = json.loads((out / "summary.json").read_text())
    main_map = [m for m in summary["maps"] if m["id"] == summary["main_map"]]
    gauge = main_map[0]["gauge"]["kind"] if main_map else "free"
    return {"name": f"{name} {seed}", "use": use, "frames": main_map[0]["frames"] if main_map else 0,
            "images": summary["frames"]["images"], "maps": len(summary["maps"]), "gauge": gauge,
            "sim3": error(dataset, out, "sim3"), "se3": error(dataset, out, "se3") if gauge != "free" else None}


def cell(ate):
    return f"{ate['rmse']:.4f} ({ate['max']:.3f})" if ate else ""


def row(result):
    if "failure" in result:
        return f"| {result['name']} | {result['use']} | {result['failure']} | | | | |"
    return (f"| {result['name']} | {result['use']} | {result['frames']} of {result['images']} | {result['maps']} | "
            f"{result['gauge']} | {cell(result['sim3'])} | {cell(result['se3'])} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=list(FLIGHTS), choices=list(FLIGHTS), metavar="NAME")
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--use", nargs="*", default=["camera", "auto"])
    parser.add_argument("--set", nargs="*", default=[], help="options passed on, name=value")
    parser.add_argument("--cache", type=Path, default=ROOT / ".cache/unlike")
    parser.add_argument("--out", type=Path, default=ROOT / "out/unlike_flights")
    arguments = parser.parse_args()
    results = []
    print("| | sensors | frames in the largest map | maps | gauge | ATE (farthest), m | after SE3, m |\n"
          "|---|---|---|---|---|---|---|", flush=True)
    for name in arguments.only:
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
            for use in arguments.use:
                results.append(run(name, seed, use, arguments))
                print(row(results[-1]), flush=True)
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "unlike_flights.json").write_text(
        json.dumps({"command": " ".join(sys.argv), "results": results}, indent=1))


if __name__ == "__main__":
    main()
