#!/usr/bin/env python3
"""Loses the program on purpose in real sequences, and tells whether it finds back: relocalisation, loops, joined maps.

  .venv/bin/python bench/system/places.py [--only NAME ...] [--variants NAME ...] [--set name=value ...]

Of each sequence it makes variants (in .cache/places, where they stay for the next time) and runs the program over them:
  as_is    the sequence itself
  drop     60 images (survey: 20) left out in the middle
  blind    30 images (survey: 5) in the middle black
  restart  the second half first, then the first
  turned   the images of the second half turned by 180 degrees
  quarter  squares, those of the second half turned by 90 degrees
  apart    two parts that show different places at first and the same one later, 40 black images in between
           (redkitchen alone)
  after X  150 images (at most half) of sequence X first, as the same camera would see them, then up to 300 of this one:
           what shows X and what shows this one must not end up in one map
The table goes to stdout as Markdown, everything to OUT/places.json; the exit status is 1 if anything false was found.
Sequences are looked for in $DEEPUAV_SHARED/data (default ../shared). Needs build/deepuav (scripts/setup.sh) and Pillow
(in .venv after scripts/test.sh).
"""
import argparse
import csv
import hashlib
import json
import os
import re
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench/system"))
from place_datasets import (SEQUENCES, Camera, Shot, load_sequence, require_libraries, show_same_place,  # noqa: E402
                            write_dataset)
from run import processor  # noqa: E402

REPEATED = ("as_is", "restart")  # run twice threaded and once sequentially
FOREIGN_FRAMES, OWN_FRAMES = 150, 300
PARTS_THAT_MEET = {"7scenes_redkitchen": ((0, 140), (820, 1000))}
REPRODUCIBLE_FILES = ("trajectory.txt", "keyframes.txt", "points.ply", "map.deepuav", "frames.csv")
EVENT = re.compile(r"map (?P<started>\d+) starts at frame (?P<start>\d+)"
                   r"|frame (?P<found>\d+) is recognised in map (?P<found_in>\d+)"
                   r"|map (?P<joining>\d+) joins map (?P<joined>\d+): keyframe (?P<by>\d+) is at keyframe (?P<at>\d+)"
                   r"|loop closed in map (?P<loop_map>\d+): keyframe (?P<loop_by>\d+) is at keyframe (?P<loop_at>\d+)")


@dataclass(frozen=True)
class Variant:
    camera: Camera
    shots: list
    lost: int | None = None  # first frame that does not follow from the one before
    back: int | None = None  # first frame from which on places could be known again
    foreign: int = 0  # so many first frames show another sequence


def make_variant(name, sequence, data):
    every = [Shot(sequence, i) for i in range(len(sequence.images))]
    middle, camera, survey = len(every) // 2, sequence.camera, sequence.horizontal
    if name == "as_is":
        return Variant(camera, every)
    if name == "drop":
        half = 10 if survey else 30
        return Variant(camera, every[:middle - half] + every[middle + half:], middle - half, middle - half)
    if name == "blind":
        dark = 5 if survey else 30
        return Variant(camera, every[:middle] + [Shot(sequence, None)] * dark + every[middle + dark:], middle,
                       middle + dark)
    if name == "restart":
        start = len(every) - middle
        return Variant(camera, every[middle:] + every[:middle], start, start)
    if name == "apart":
        first, second = PARTS_THAT_MEET[sequence.name]
        start = first[1] - first[0]
        dark = [Shot(sequence, None)] * 40
        return Variant(camera, every[slice(*first)] + dark + every[slice(*second)], start, start + len(dark))
    if name in ("turned", "quarter"):
        turns = 2 if name == "turned" else 1
        shots = every[:middle] + [Shot(sequence, i, turns) for i in range(middle, len(every))]
        return Variant(camera.around_centre(square=turns == 1), shots, middle, middle)
    other = load_sequence(name.removeprefix("after "), data)
    foreign = [Shot(other, i) for i in range(min(FOREIGN_FRAMES, len(other.images) // 2))]
    return Variant(camera.seen_by_both(other.camera), foreign + every[:OWN_FRAMES], len(foreign), len(foreign),
                   len(foreign))


def variant_names(sequence_name, present):
    apart = ["apart"] if sequence_name in PARTS_THAT_MEET else []
    return ["as_is", "drop", "blind", "restart", "turned", "quarter", *apart,
            *(f"after {other}" for other in present if other != sequence_name)]


def read_frame_table(file):
    with file.open(newline="") as table:
        return list(csv.DictReader(table))


def run_program(arguments, dataset, out, schedule):
    """One run. Gives its summary, with the events of its log, its frames and the hash of its results added."""
    command = [arguments.program, "run", dataset, "--out", out, "--schedule", schedule, "--log-level",
               arguments.log_level]
    for assignment in arguments.set:
        command += ["--set", assignment]
    out.mkdir(parents=True, exist_ok=True)
    (out / "summary.json").unlink(missing_ok=True)  # that of an earlier run
    with (out / "log.txt").open("w") as log:
        status = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=log).returncode
    if status not in (0, 1) or not (out / "summary.json").exists():
        raise SystemExit(f"places.py: {' '.join(map(str, command))} ended with {status}: see {out}/log.txt")
    run = {"summary": json.loads((out / "summary.json").read_text()), "frames": read_frame_table(out / "frames.csv"),
           "events": [match.groupdict() for match in EVENT.finditer((out / "log.txt").read_text())]}
    digest = hashlib.sha256()
    for name in REPRODUCIBLE_FILES:
        digest.update((out / name).read_bytes())
    run["sha256"] = digest.hexdigest()
    return run


def evaluate(arguments, dataset, out, horizontal):
    """ATE of the largest map, as eval prints it; None without a map."""
    report = out / "eval.json"
    result = subprocess.run([arguments.program, "eval", dataset, out / "trajectory.txt", "--json", report,
                             *(["--horizontal"] if horizontal else [])], stdout=subprocess.DEVNULL,
                            stderr=subprocess.DEVNULL)
    return json.loads(report.read_text())["ate_m"] if result.returncode == 0 else None


class Replay:
    """Which maps there were when, from the log's events."""

    def __init__(self, run):
        self.frame_of_keyframe = {int(row["keyframe"]): int(row["frame"]) for row in run["frames"] if row["keyframe"]}
        self.tracked = [row["state"] == "tracked" for row in run["frames"]]
        self.starts, self.switches, self.joins = {}, [], []
        for event in run["events"]:
            if event["started"]:
                self.starts[int(event["started"])] = int(event["start"])
                self.switches.append((int(event["start"]), int(event["started"])))
            elif event["found"]:
                self.switches.append((int(event["found"]), int(event["found_in"])))
            elif event["joining"]:
                self.joins.append((self.frame_of(int(event["by"])), int(event["joining"]), int(event["joined"])))

    def frame_of(self, keyframe):
        """Of a keyframe that was culled, the one of the next that stayed."""
        later = [k for k in self.frame_of_keyframe if k >= keyframe]
        return self.frame_of_keyframe[min(later)] if later else len(self.tracked)

    def first_tracked(self, start, among=None):
        """The first frame from `start` on that had its pose at once, in one of the maps `among` or what joined them."""
        for frame in range(start, len(self.tracked)):
            if not self.tracked[frame]:
                continue
            if among is None:
                return frame
            known = set(among)
            for joined_at, a, b in sorted(self.joins):
                if joined_at <= frame and known & {a, b}:
                    known |= {a, b}
            current = max((switch for switch in enumerate(self.switches) if switch[1][0] <= frame),
                          key=lambda switch: (switch[1][0], switch[0]))[1][1]
            if current in known:
                return frame
        return None

    def found_again(self, variant):
        known = [map_id for map_id, start in self.starts.items() if start < variant.lost]
        return self.first_tracked(variant.back, known)


def first_known_place(variant):
    """The first frame after the jump that surely shows what was seen before it."""
    before = variant.shots[:variant.lost]
    for frame in range(variant.back, len(variant.shots)):
        if any(show_same_place(variant.shots[frame], shot) for shot in before):
            return frame
    return None


def false_findings(variant, run, replay):
    """Maps that hold both sequences, and loops and joints between images that cannot show the same place."""
    found = []
    foreign = {row["map"] for row in run["frames"][:variant.foreign] if row["map"]}
    own = {row["map"] for row in run["frames"][variant.foreign:] if row["map"]} if variant.foreign else set()
    found += [f"map {map_id} holds both sequences" for map_id in sorted(foreign & own)]
    for event in run["events"]:
        by, at = event["by"] or event["loop_by"], event["at"] or event["loop_at"]
        if by is None:
            continue
        frames = [replay.frame_of_keyframe.get(int(keyframe)) for keyframe in (by, at)]
        if None not in frames and show_same_place(*(variant.shots[frame] for frame in frames)) is False:
            found.append(f"frame {frames[0]} is not at frame {frames[1]}")
    return found


def measure(arguments, sequence, name, data):
    variant = make_variant(name, sequence, data)
    label = f"{sequence.name}-{name.replace(' ', '_')}"
    dataset = arguments.cache / label
    write_dataset(dataset, variant.camera, sequence.rate_hz, variant.shots)
    if arguments.make_only:
        return None
    schedules = ["threaded"] * arguments.repeats + ["sequential"] if name in REPEATED else ["threaded"]
    runs = [run_program(arguments, dataset, arguments.out / f"{label}-{i}-{schedule}", schedule)
            for i, schedule in enumerate(schedules)]
    first = runs[0]
    replay, summary = Replay(first), first["summary"]
    result = {"sequence": sequence.name, "variant": name, "schedules": schedules, "summary": summary,
              "events": first["events"], "seeing_frames": sum(shot.index is not None for shot in variant.shots),
              "identical": len({run["sha256"] for run in runs}) == 1 if len(runs) > 1 else None,
              "false": false_findings(variant, first, replay),
              "frames_per_s": [run["summary"]["frames"]["processed"] / run["summary"]["wall_s"] for run in runs]}
    if not variant.foreign:
        result["ate_m"] = evaluate(arguments, dataset, arguments.out / f"{label}-0-{schedules[0]}", sequence.horizontal)
    states = Counter(row["map"] for row in first["frames"])
    result["in_main_map"] = states[str(summary["main_map"])]
    if variant.back is not None:
        after_s = {"tracked": replay.first_tracked(variant.back)}
        if not variant.foreign:
            after_s |= {"known_place": first_known_place(variant), "found_again": replay.found_again(variant)}
        result["after_s"] = {what: None if frame is None else (frame - variant.back) / sequence.rate_hz
                             for what, frame in after_s.items()}
    return result


def seconds(result, what):
    if what not in result.get("after_s", {}):
        return ""
    value = result["after_s"][what]
    return "never" if value is None else f"{value:.1f}"


def table_row(result):
    summary, ate = result["summary"], result.get("ate_m")
    error = "" if "ate_m" not in result else f"{ate['rmse']:.4f} ({ate['max']:.2f})" if ate else "none"
    rates = sorted(result["frames_per_s"])
    identical = {None: "", True: "yes", False: "NO"}[result["identical"]]
    return (f"| {result['sequence']} | {result['variant']} | {error} | {summary['frames']['located']} | "
            f"{result['in_main_map']} of {result['seeing_frames']} | {len(summary['maps'])} | "
            f"{summary['relocalisations']} | {summary['closed_loops']} | {summary['merged_maps']} | "
            f"{seconds(result, 'tracked')} | {seconds(result, 'known_place')} | {seconds(result, 'found_again')} | "
            f"{len(result['false'])} | {identical} | {summary['wall_s']:.0f} | {rates[-1]:.1f} |")


HEADER = """| sequence | variant | ATE (Sim3), m: rmse (largest) | located | in the main map | maps | relocalisations | loops | joined maps | tracked again after, s | known place after, s | found in an old map after, s | false | identical | wall, s | frames/s |
|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=list(SEQUENCES), help="names of sequences")
    parser.add_argument("--variants", nargs="*", help="names of variants; 'after X' as one word in quotes")
    parser.add_argument("--set", nargs="*", default=[], help="options of the runs, name=value")
    parser.add_argument("--repeats", type=int, default=2, help=f"threaded runs of {' and '.join(REPEATED)}")
    parser.add_argument("--program", type=Path, default=ROOT / "build/deepuav")
    parser.add_argument("--log-level", choices=("info", "debug"), default="info", help="of log.txt in each run's folder")
    parser.add_argument("--make-only", action="store_true", help="make the datasets and stop")
    parser.add_argument("--cache", type=Path, default=ROOT / ".cache/places")
    parser.add_argument("--out", type=Path, default=ROOT / "out/places")
    arguments = parser.parse_args()
    require_libraries("places.py")
    data = Path(os.environ.get("DEEPUAV_SHARED", ROOT / "../shared")) / "data"
    present = [name for name in SEQUENCES if (data / name).is_dir()]

    results = {"machine": processor(), "command": " ".join(sys.argv), "results": []}
    print(f"Machine: {results['machine']}\n\n{HEADER}")
    for name in arguments.only:
        if name not in present:
            print(f"| {name} | skipped: not in {data} " + "| " * 14 + "|")
            continue
        sequence = load_sequence(name, data)
        for variant in variant_names(name, present):
            if arguments.variants and variant not in arguments.variants:
                continue
            result = measure(arguments, sequence, variant, data)
            if result is None:
                continue
            results["results"].append(result)
            print(table_row(result), flush=True)
            arguments.out.mkdir(parents=True, exist_ok=True)
            (arguments.out / "places.json").write_text(json.dumps(results, indent=1))
    false = [(r["sequence"], r["variant"], finding) for r in results["results"] for finding in r["false"]]
    for sequence_name, variant, finding in false:
        print(f"\n{sequence_name}, {variant}: {finding}")
    return 1 if false else 0


if __name__ == "__main__":
    sys.exit(main())
