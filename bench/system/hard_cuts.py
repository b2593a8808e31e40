#!/usr/bin/env python3
"""Compares networks in the whole program on sequences made harder.

  .venv/bin/python bench/system/hard_cuts.py [--models default FILE default+superglue ...] [--only NAME ...] [--cuts NAME ...]

Of each sequence it makes cuts (in .cache/hard_cuts, where they stay for the next time) and runs the program over them
with each network:
  as_is    the sequence itself
  third    every third image
  fifth    every fifth image
  eighth   every eighth image
  dim      the second half at half the brightness
  blur     every image blurred by 12 pixels of motion, each in a direction of its own
  writing  a display's writing, scales and cross over every image
  noise    noise of 15 of 255
  mirrored left and right changed
  reversed from the last image to the first
  video    as a drone's link sends it: H.264 at 0.05 bits a pixel (needs ffmpeg)
  repeats  every third image is the one before once more, as where a receiver fills gaps
  drops    one image in five is lost, up to several in a row
  exposure brightness jumps to between 0.5 and 1.5 times itself every 1.5 s
  thermal  as a thermal camera sees: soft, two fifths of the contrast, columns of their own brightness
  foggy    a fifth of the contrast
  dark     15 % of the brightness, with noise
  wet      drops on the lens
  banded   lamps flicker while the shutter rolls
  compressed  JPEG of quality 12
The table (absolute trajectory error over the frames of the largest map, in brackets the largest, and how many frames it
holds; where there are further maps, frames in all and maps) goes to stdout as Markdown, everything to OUT/hard_cuts.json.
Sequences are looked for in $DEEPUAV_SHARED/data (default ../shared); a flight is named by the folder that it was rendered
into. Needs build/deepuav (scripts/setup.sh) and Pillow (in .venv after scripts/test.sh).
"""
import argparse
import json
import os
import random
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench/system"))
from damaged_images import DAMAGES  # noqa: E402
from place_datasets import Shot, load_sequence, require_libraries, write_dataset  # noqa: E402
from run import processor  # noqa: E402

EVERY = {"third": 3, "fifth": 5, "eighth": 8}
CUTS = ("as_is", *EVERY, "dim", "blur", "writing", "noise", "mirrored", "reversed", "video", "repeats", "drops",
        "exposure", *DAMAGES)
BLUR_PX = 12
NOISE = 15
DROPPED = 0.2
EXPOSURES = (0.5, 1.5)
EXPOSURE_S = 1.5
DEFAULT = "default"
METHODS = ("nearest", "superglue")


def make_cut(cut, sequence):
    """The shots and the images a second."""
    every = [Shot(sequence, i) for i in range(len(sequence.images))]
    if cut in EVERY:
        return every[::EVERY[cut]], sequence.rate_hz / EVERY[cut]
    if cut == "dim":
        middle = len(every) // 2
        return every[:middle] + [Shot(sequence, i, brightness=0.5) for i in range(middle, len(every))], sequence.rate_hz
    if cut == "blur":
        return [Shot(sequence, i, blur_px=BLUR_PX) for i in range(len(every))], sequence.rate_hz
    changed = {"writing": {"writing": True}, "noise": {"noise": NOISE}, "mirrored": {"mirrored": True}}.get(cut)
    if changed:
        return [Shot(sequence, i, **changed) for i in range(len(every))], sequence.rate_hz
    if cut in DAMAGES:
        return [Shot(sequence, i, damage=cut) for i in range(len(every))], sequence.rate_hz
    if cut == "reversed":
        return every[::-1], sequence.rate_hz
    if cut == "repeats":
        return [every[i - 1] if i % 3 == 2 else shot for i, shot in enumerate(every)], sequence.rate_hz
    if cut == "drops":
        draw = random.Random(0)
        return [shot if draw.random() >= DROPPED else None for shot in every], sequence.rate_hz
    if cut == "exposure":
        draw = random.Random(0)
        steps = [draw.uniform(*EXPOSURES) for _ in range(len(every))]
        return [Shot(sequence, i, brightness=steps[int(i / sequence.rate_hz / EXPOSURE_S)]) for i in range(len(every))], \
            sequence.rate_hz
    return every, sequence.rate_hz


def run_once(program, dataset, model, out, horizontal):
    """Summary of the run and error of its largest map; no error without a map."""
    command = [program, "run", dataset, "--out", out, "--log-level", "error"]
    features, _, method = model.partition("+")
    if features != DEFAULT:
        command += ["--model", features]
    if method:
        command += ["--set", f"matching.method={method}"]
    (out / "summary.json").unlink(missing_ok=True)  # that of an earlier run
    status = subprocess.run(command, stdout=subprocess.DEVNULL).returncode
    if status not in (0, 1) or not (out / "summary.json").exists():
        raise SystemExit(f"hard_cuts.py: {' '.join(map(str, command))} failed")
    report = out / "eval.json"
    evaluated = subprocess.run([program, "eval", dataset, out / "trajectory.txt", "--json", report,
                                *(["--horizontal"] if horizontal else [])], stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
    ate = json.loads(report.read_text())["ate_m"] if evaluated.returncode == 0 else None
    return {"summary": json.loads((out / "summary.json").read_text()), "ate_m": ate}


def in_main_map(summary):
    return sum(m["frames"] for m in summary["maps"] if m["id"] == summary["main_map"])


def cell(run):
    error = f"{run['ate_m']['rmse']:.4f} ({run['ate_m']['max']:.3f})" if run["ate_m"] else "none"
    summary = run["summary"]
    maps = len(summary["maps"])
    located = sum(m["frames"] for m in summary["maps"])
    return f"{error}, {in_main_map(summary)}" + (f" ({located} in {maps} maps)" if maps != 1 else "")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--models", nargs="*", default=[DEFAULT, str(ROOT / "../shared/models/superpoint_coco.onnx")],
                        help=f"network files; '{DEFAULT}': the one that runs by default; with + and one of {', '.join(METHODS)} behind: "
                             "matching.method")
    parser.add_argument("--only", nargs="*", default=["euroc_mh01_excerpt", "7scenes_redkitchen", "uav_nadir_survey"])
    parser.add_argument("--cuts", nargs="*", default=list(CUTS), choices=CUTS)
    parser.add_argument("--program", type=Path, default=ROOT / "build/deepuav")
    parser.add_argument("--cache", type=Path, default=ROOT / ".cache/hard_cuts")
    parser.add_argument("--out", type=Path, default=ROOT / "out/hard_cuts")
    arguments = parser.parse_args()
    require_libraries("hard_cuts.py")
    data = Path(os.environ.get("DEEPUAV_SHARED", ROOT / "../shared")) / "data"
    names = [Path(model).stem for model in arguments.models]
    results = {"machine": processor(), "command": " ".join(sys.argv), "runs": []}
    print(f"Machine: {results['machine']}\n\n| sequence | cut | frames | {' | '.join(names)} |")
    print("|---" * (3 + len(names)) + "|")
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name in arguments.only:
        label = Path(name).name
        if not (data / name).is_dir():  # an absolute name stays as it is
            print(f"| {label} | skipped: not in {data} |" + " |" * (1 + len(names)))
            continue
        sequence = load_sequence(name, data)
        for cut in arguments.cuts:
            if cut == "video" and not shutil.which("ffmpeg"):
                print(f"| {label} | {cut} | skipped: no program ffmpeg |" + " |" * len(names))
                continue
            shots, rate_hz = make_cut(cut, sequence)
            dataset = arguments.cache / f"{label}-{cut}"
            camera = sequence.camera.mirrored() if cut == "mirrored" else sequence.camera
            write_dataset(dataset, camera, rate_hz, shots, video=cut == "video")
            runs = [run_once(arguments.program, dataset, model, arguments.out / f"{label}-{cut}-{network}",
                             sequence.horizontal) for model, network in zip(arguments.models, names)]
            results["runs"] += [{"sequence": label, "cut": cut, "model": model, **run}
                                for model, run in zip(arguments.models, runs)]
            frames = sum(shot is not None for shot in shots)
            print(f"| {label} | {cut} | {frames} | {' | '.join(map(cell, runs))} |", flush=True)
            (arguments.out / "hard_cuts.json").write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
