#!/usr/bin/env python3
"""Simulated surveys as drones deliver them, told nothing of the lens: photographs from very different heights, and many.

  bench/system/simulated_surveys.py [--only NAME ...] [--first-seed N] [--seeds N] [--photographs N]
                                    [--set name=value ...]

| name | what |
|---|---|
| climb | flights/climb.yaml from 10 to 120 m and back, a photograph every 2 s, over countryside |
| climb_random, climb_exif | the same photographs in random order; with EXIF that says 5 % too much |
| climb_rtk, large_rtk | the photographs with XMP of positions to 1 (up: 2) cm, as by a receiver with corrections |
| climb_turning | the same climb under a heading that follows the spiral |
| climb_once | up once and not back, a photograph every 2.5 s, a wider spiral over a village |
| climb_steps | a photograph every 4 s, over a town: steps of 15 m of height |
| strip | one line of photographs from 50 m along a road through countryside |
| long_road, long_river | lines of 600 m along a road and a river, in some seeds' scenes alone |
| facades | flights/facade.yaml, a photograph every 1.25 s: posters that are the same to the pixel |
| meadow | a line over a meadow whose texture comes again every 16 photographs |
| two_heights | lines over a village at 20 m, then at 70 m across them, nothing in between |
| sparse | lines over a village, of which neighbouring photographs share three tenths; one in three is left out |
| solar | lines over rows of solar panels, all alike, fields between them; solar_rtk: as large_rtk |
| climb_measured, sparse_measured, strip_measured, solar_measured | with XMP of the lens as its maker measured it (f: 0.2 %) |
| large | 300 photographs of 4000x3000 from 60 m over a village in lines and cross lines |
| wide | 934 photographs from 60 m over a village and its fields in lines and cross lines |

Photographs of 1600x1200 but those of `large`, whose pixels are each one ray; k1 = -0.25. They are rendered into CACHE
once a seed, which is the scene's, too, and stay there. Prints a Markdown table, a row a run: photographs in the main map,
maps, by how much the scale differs between sections of height (each twice as high as the one below; distances between
the photographs of a section over the true ones, largest over least, in %), by how much the focal length is longer than
the true one in % and k1 larger, root mean square error of the positions after Sim3 (after Sim3 in plan, horizontally;
with XMP horizontally and in height where they are said to be on Earth), seconds and memory. Constants are chosen on
seeds 4 and up, and reported on 1 to 3. Everything goes to OUT. Needs build/deepuav and Python's standard library.
"""
import argparse
import itertools
import json
import math
import random
import shutil
import struct
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench/system"))
from surveys import evaluate, main_map, run, table_row, write_positions  # noqa: E402

PROGRAM = ROOT / "build/deepuav"
K1 = -0.25
LENS = {"camera.width": 1600, "camera.height": 1200, "camera.fx": 1300, "camera.fy": 1300, "camera.cx": 805,
        "camera.cy": 595, "camera.distortion": f"{K1} 0.08 0 0", "imu.rate_hz": 20, "sensor.samples": 1}
CLIMB = {"course.top_height_m": 120, "camera.rate_hz": 0.5}
LARGE_LENS = {"camera.width": 4000, "camera.height": 3000, "camera.fx": 3250, "camera.fy": 3250, "camera.cx": 2012,
              "camera.cy": 1488}
LINES = {  # To and fro at 20 m, then across at 70 m: east and north of the middle, height; pauses end the lines.
    "course.kind": "waypoints", "course.speed_m_s": 5, "camera.rate_hz": 0.6667, "flight.duration_s": 120,
    "course.waypoints": "-40 -12 20 1; 40 -12 20 1; 40 -4 20 1; -40 -4 20 1; -40 4 20 1; 40 4 20 1"}
HIGH_LINES = {"course.speed_m_s": 8, "camera.rate_hz": 0.3333, "flight.duration_s": 120,
              "course.kind": "waypoints", "course.waypoints": "-20 -60 70 1; -20 60 70 1; 20 60 70 1; 20 -60 70 1"}
LONG_LINE = {"flight.scene": "countryside", "course.kind": "corridor", "course.along_start_m": 150, "course.length_m": 500,
             "course.height_m": 50, "course.speed_m_s": 8, "camera.rate_hz": 0.5}
# Name: the flights whose photographs are joined, each a flight's name and options.
FLIGHTS = {
    "climb": [("climb", CLIMB)],
    "climb_turning": [("climb", {**CLIMB, "course.yaw": "course"})],
    "climb_once": [("climb", {**CLIMB, "camera.rate_hz": 0.4, "course.radius_m": 20, "course.center_x_m": 0,
                              "course.center_y_m": 0, "flight.scene": "village", "flight.duration_s": 32})],
    "sparse": [("survey", {"course.length_m": 200, "course.width_m": 150, "course.line_spacing_m": 52, "course.height_m": 60,
                           "course.speed_m_s": 8, "camera.rate_hz": 0.2, "flight.duration_s": 150})],
    "climb_steps": [("climb", {**CLIMB, "camera.rate_hz": 0.25, "course.center_x_m": 60, "course.center_y_m": 30,
                               "flight.scene": "town"})],
    "strip": [("survey", {"flight.scene": "countryside", "course.kind": "corridor", "course.along": "road",
                          "course.along_start_m": 150, "course.length_m": 450, "course.height_m": 50, "course.speed_m_s": 8,
                          "camera.rate_hz": 0.5, "flight.duration_s": 100})],
    "long_road": [("survey", {**LONG_LINE, "course.along": "road", "flight.duration_s": 100})],
    "long_river": [("survey", {**LONG_LINE, "course.along": "river", "flight.duration_s": 90})],
    "facades": [("facade", {"camera.rate_hz": 0.8})],
    "meadow": [("survey", {"flight.scene": "countryside", "course.kind": "waypoints", "course.speed_m_s": 8,
                           "course.waypoints": "-300 -40 50; -100 40 50; 100 -10 50; 300 60 50", "camera.rate_hz": 0.5,
                           "flight.duration_s": 90})],
    "two_heights": [("survey", LINES), ("survey", HIGH_LINES)],
    "large": [("survey", {**LARGE_LENS, "course.length_m": 200, "course.width_m": 180, "course.line_spacing_m": 25,
                          "course.height_m": 60, "course.speed_m_s": 8, "flight.duration_s": 449.5,
                          "camera.rate_hz": 0.6667})],
    "solar": [("survey", {"flight.scene": "solar", "course.length_m": 110, "course.width_m": 90, "course.line_spacing_m": 16,
                          "course.height_m": 45, "course.speed_m_s": 8, "camera.rate_hz": 0.6667, "flight.duration_s": 120})],
    "wide": [("survey", {"course.length_m": 380, "course.width_m": 340, "course.line_spacing_m": 25, "course.height_m": 60,
                         "course.speed_m_s": 8, "flight.duration_s": 1400, "camera.rate_hz": 0.6667})],
}
# Name: the flights it is made of, and what becomes of their photographs.
VARIANTS = {"climb_random": ("climb", "random"), "climb_exif": ("climb", "exif"),
            "climb_measured": ("climb", "measured"), "sparse_measured": ("sparse", "measured"),
            "strip_measured": ("strip", "measured"), "solar_measured": ("solar", "measured"),
            "climb_rtk": ("climb", "rtk"), "large_rtk": ("large", "rtk"), "solar_rtk": ("solar", "rtk"),
            **{name: (name, "plain") for name in FLIGHTS}}
THINNED_FLIGHTS = {"sparse"}
NAMES = ["climb", "climb_random", "climb_exif", "climb_measured", "climb_rtk", "large_rtk", "climb_turning", "climb_once",
         "climb_steps", "sparse", "sparse_measured", "strip", "strip_measured", "long_road", "long_river", "facades", "meadow",
         "two_heights", "solar", "solar_measured", "solar_rtk", "large", "wide"]
LOWEST_HEIGHT_M = 10
ORIGIN_DEG, ORIGIN_ALTITUDE_M = (47.4, 8.5), 450
RTK_SIGMA_M = (0.01, 0.01, 0.02)
EXIF_EXCESS = 1.05
MEASURED_SIGMA = 0.002
THINNED = 1 / 3
FULL_FRAME_DIAGONAL_MM = 43.27


def render(flights, seed, name, arguments):
    """The folders of the flights, rendered where they are not there."""
    folders = []
    for number, (flight, options) in enumerate(flights):
        folder = arguments.cache / f"{name}-{number}-seed-{seed}"
        command = [PROGRAM, "simulate", "--flight", flight, "--out", folder, "--seed", seed, "--frames",
                   arguments.photographs, "--log-level", "warn"]
        for option, value in {**LENS, **options, "scene.seed": seed}.items():
            command += ["--set", f"{option}={value}"]
        subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)
        folders.append(folder)
    return folders


def with_focal_length(jpeg, focal_35mm):
    """The JPEG with an EXIF segment that says the focal length as that of a film of 35 mm."""
    exif_tag, focal_tag, long, short = 0x8769, 0xA405, 4, 3
    tiff = b"II*\0" + struct.pack("<I", 8)
    tiff += struct.pack("<HHHIII", 1, exif_tag, long, 1, 26, 0)
    tiff += struct.pack("<HHHIHHI", 1, focal_tag, short, 1, focal_35mm, 0, 0)
    body = b"Exif\0\0" + tiff
    return jpeg[:2] + b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body + jpeg[2:]


def with_xmp(jpeg, fields):
    """The JPEG with DJI's XMP."""
    body = b"http://ns.adobe.com/xap/1.0/\0" + " ".join(f'drone-dji:{key}="{value}"' for key, value in fields.items()).encode()
    return jpeg[:2] + b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body + jpeg[2:]


def with_lens(jpeg, generator):
    """The JPEG with DJI's XMP of a lens as designed, a hundredth too long, and as its maker measured it."""
    width, height, focal_px = (LENS[f"camera.{name}"] for name in ("width", "height", "fx"))
    measured_px = focal_px * (1 + generator.gauss(0, MEASURED_SIGMA))
    centre = [LENS["camera.cx"] + 0.5 - width / 2, LENS["camera.cy"] + 0.5 - height / 2]
    k1, k2, p1, p2 = (float(value) for value in LENS["camera.distortion"].split())
    values = [measured_px, measured_px, *centre, k1, k2, p1, p2, 0]
    return with_xmp(jpeg, {
        "CalibratedFocalLength": f"{1.01 * focal_px:.6f}", "CalibratedOpticalCenterX": f"{width / 2:.6f}",
        "CalibratedOpticalCenterY": f"{height / 2:.6f}",
        "DewarpData": "2021-05-06;" + ",".join(f"{value:.12g}" for value in values), "DewarpFlag": "0"})


def metres_per_radian():
    """Of latitude and of longitude at the origin: over some hundred metres its plane is good to millimetres."""
    latitude = math.radians(ORIGIN_DEG[0])
    a, e2 = 6378137, 0.00669437999014  # WGS 84
    north = a * (1 - e2) / (1 - e2 * math.sin(latitude) ** 2) ** 1.5 + ORIGIN_ALTITUDE_M
    return north, (a / math.sqrt(1 - e2 * math.sin(latitude) ** 2) + ORIGIN_ALTITUDE_M) * math.cos(latitude)


def with_fix(jpeg, position, generator):
    """The JPEG with DJI's XMP of a measured position, and that position, east, north and up of the origin in metres."""
    measured = [value + generator.gauss(0, sigma) for value, sigma in zip(position, RTK_SIGMA_M)]
    north, east = metres_per_radian()
    return with_xmp(jpeg, {
        "GpsLatitude": f"{ORIGIN_DEG[0] + math.degrees(measured[1] / north):+.10f}",
        "GpsLongitude": f"{ORIGIN_DEG[1] + math.degrees(measured[0] / east):+.10f}",
        "AbsoluteAltitude": f"{ORIGIN_ALTITUDE_M + measured[2]:+.3f}", "RtkFlag": "50",
        "RtkStdLon": f"{RTK_SIGMA_M[0]:.5f}", "RtkStdLat": f"{RTK_SIGMA_M[1]:.5f}",
        "RtkStdHgt": f"{RTK_SIGMA_M[2]:.5f}"}), measured


def as_photographs(simulated, folder, how, thinned, seed):
    """Photographs that know no time but their order; where each was taken, east, north and up in metres, and of what
    first measured position a map on Earth is, or None."""
    images = folder / "images"
    shutil.rmtree(folder, ignore_errors=True)
    images.mkdir(parents=True)
    taken = []
    for flight in simulated:
        for line in (flight / "groundtruth_cam0.csv").read_text().splitlines()[1:]:
            time, *position = line.split(",")[:4]
            file = flight / f"mav0/cam0/data/{time}.jpg"
            if file.is_file():
                taken.append((file, [float(value) for value in position]))
    generator = random.Random(seed)
    if how == "random":
        generator.shuffle(taken)
    if thinned:
        taken = [shot for shot in taken if generator.random() >= THINNED]
    origin = None
    for number, (file, position) in enumerate(taken):
        if how == "exif":
            diagonal = math.hypot(LENS["camera.width"], LENS["camera.height"])
            focal_35mm = round(EXIF_EXCESS * LENS["camera.fx"] / diagonal * FULL_FRAME_DIAGONAL_MM)
            (images / f"{number:04}.jpg").write_bytes(with_focal_length(file.read_bytes(), focal_35mm))
        elif how == "rtk":
            jpeg, measured = with_fix(file.read_bytes(), position, generator)
            origin = origin or measured
            (images / f"{number:04}.jpg").write_bytes(jpeg)
        elif how == "measured":
            (images / f"{number:04}.jpg").write_bytes(with_lens(file.read_bytes(), random.Random(seed)))
        else:
            (images / f"{number:04}.jpg").symlink_to(file.resolve())
    return [position for _, position in taken], origin


def scale_spread(places, truth):
    """By how many % the scale differs between sections of height, each twice as high as the one below; None for one."""
    ground = min(position[2] for position in truth) - LOWEST_HEIGHT_M
    sections = {}
    for number, place in places.items():
        section = int(math.log2(max(1, (truth[number][2] - ground) / LOWEST_HEIGHT_M)))
        sections.setdefault(section, []).append((place, truth[number]))
    scales = []
    for section in sections.values():
        found = sum(math.dist(a[0], b[0]) ** 2 for a, b in itertools.combinations(section, 2))
        true = sum(math.dist(a[1], b[1]) ** 2 for a, b in itertools.combinations(section, 2))
        if true > 0:
            scales.append(math.sqrt(found / true))
    return 100 * (max(scales) / min(scales) - 1) if len(scales) > 1 else None


def errors_on_earth(places, truth, origin):
    """Horizontally and in height, m; nothing without an origin."""
    if not origin or not places:
        return {}
    off = [[p + o - t for p, o, t in zip(place, origin, truth[number])] for number, place in places.items()]
    squares = [sum(error[axis] ** 2 for error in off) / len(off) for axis in range(3)]
    return {"east_north_m": math.sqrt(squares[0] + squares[1]), "up_m": math.sqrt(squares[2])}


def measure(name, seed, arguments):
    flights, how = VARIANTS[name]
    simulated = render(FLIGHTS[flights], seed, flights, arguments)
    out = arguments.out / f"{name}-{seed}"
    truth, origin = as_photographs(simulated, out / "photographs", how, flights in THINNED_FLIGHTS, seed)
    result = run(name, out / "photographs", out, arguments)
    if "failure" in result:
        return {**result, "seed": seed}
    folder = Path(result["folder"])
    places = main_map(folder)
    write_positions(out / "truth.txt", [(number, position) for number, position in enumerate(truth)])
    write_positions(out / "main.txt", list(places.items()))
    full = evaluate(out / "truth.txt", out / "main.txt")
    flat = evaluate(out / "truth.txt", out / "main.txt", "--horizontal")
    options = {**LENS, **FLIGHTS[flights][0][1]}
    return {**result, **errors_on_earth(places, truth, origin), "seed": seed, "ate_m": full and full["ate_m"]["rmse"],
            "horizontal_m": flat and flat["ate_m"]["rmse"], "scale_spread": scale_spread(places, truth),
            "focal_error": 100 * (result["focal_px"] / options["camera.fx"] - 1) if result["focal_px"] else None,
            "k1_error": result["k1"] - K1 if result["k1"] is not None else None}


def row(result):
    on_earth = "; on Earth {east_north_m:.3f}, up {up_m:.3f}" if "up_m" in result else ""
    return table_row(result, f"{result['name']} {result['seed']}",
                     ["{scale_spread:.2f}", "{focal_error:+.2f}", "{k1_error:+.3f}",
                      "{ate_m:.3f} ({horizontal_m:.3f})" + on_earth])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=NAMES, choices=NAMES)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--photographs", type=int, default=-1, help="of each flight, at most; -1: all")
    parser.add_argument("--set", nargs="*", default=[], help="options passed on to run, name=value")
    parser.add_argument("--cache", type=Path, default=ROOT / ".cache/photographs")
    parser.add_argument("--out", type=Path, default=ROOT / "out/simulated_surveys")
    arguments = parser.parse_args()
    print("| seed | photographs in the main map | maps | scale, % | focal length, % | k1 | error (horizontal), m | s | MB |\n"
          "|---|---|---|---|---|---|---|---|---|")
    results = []
    for name in arguments.only:
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
            results.append(measure(name, seed, arguments))
            print(row(results[-1]), flush=True)
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "simulated_surveys.json").write_text(
        json.dumps({"command": " ".join(sys.argv), "results": results}, indent=1))


if __name__ == "__main__":
    main()
