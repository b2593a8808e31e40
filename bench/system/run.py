#!/usr/bin/env python3
"""Runs the whole program over real sequences, and prints and stores what came out.

  bench/system/run.py [--model FILE] [--repeats N] [--only NAME ...] [--set name=value ...]

For each sequence: absolute trajectory error (Sim3), frames located, maps, speed, memory and stage times; whether
repeated runs, and sequential against threaded, gave identical bytes. The table goes to stdout as Markdown, everything
to OUT/results.json. Sequences are looked for in $DEEPUAV_SHARED/data (default ../shared); absent ones are skipped and
named. Needs build/deepuav (scripts/setup.sh) and Python's standard library.
"""
import argparse
import hashlib
import json
import os
import platform
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SEQUENCES = {
    "euroc_mh01_excerpt": {"run": [], "eval": []},
    "7scenes_redkitchen": {"run": [], "eval": []},
    "uav_nadir_survey": {"run": [], "eval": ["--horizontal"]},
}


def processor():
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return f"{line.split(':')[1].strip()}, {os.cpu_count()} cores"
    return f"{platform.machine()}, {os.cpu_count()} cores"


def run_once(dataset, name, schedule, arguments, out):
    """One run of the program. Returns its summary, with the accuracy and the trajectory's hash added."""
    sequence = SEQUENCES[name]
    command = [ROOT / "build/deepuav", "run", dataset, "--out", out, "--schedule", schedule, "--log-level", "warn",
               *sequence["run"]]
    if arguments.model:
        command += ["--set", f"features.model={arguments.model}"]
    for assignment in arguments.set:
        command += ["--set", assignment]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    summary = json.loads((out / "summary.json").read_text())
    report = out / "eval.json"
    subprocess.run([ROOT / "build/deepuav", "eval", dataset, out / "trajectory.txt", *sequence["eval"], "--json", report],
                   check=True, stdout=subprocess.DEVNULL)
    summary["evaluation"] = json.loads(report.read_text())
    summary["trajectory_sha256"] = hashlib.sha256((out / "trajectory.txt").read_bytes()).hexdigest()
    return summary


def ate(summary):
    return summary["evaluation"]["ate_m"]["rmse"]


def table_row(name, runs):
    first = runs[0]
    errors = sorted(ate(r) for r in runs)
    frames = first["frames"]
    identical = "yes" if len({r["trajectory_sha256"] for r in runs}) == 1 else "NO"
    rate = sorted(frames["processed"] / r["wall_s"] for r in runs)
    spread = f"{errors[0]:.4f}" if errors[0] == errors[-1] else f"{errors[0]:.4f} to {errors[-1]:.4f}"
    return (f"| `{name}` | {spread} | {frames['located']} of {frames['processed']} | {len(first['maps'])} | "
            f"{first['maps'][0]['keyframes']} | {rate[0]:.1f} to {rate[-1]:.1f} | "
            f"{max(r['peak_resident_mb'] for r in runs):.0f} | {max(r['start_up_s'] for r in runs):.1f} | {identical} |")


def stage_table(summary):
    rows = ["| stage | calls | median, ms | p95, ms |", "|---|---|---|---|"]
    for stage, times in summary["stages"].items():
        rows.append(f"| {stage} | {times['count']} | {times['median_ms']:.2f} | {times['p95_ms']:.2f} |")
    return "\n".join(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", help="SuperPoint network; default: the program's own")
    parser.add_argument("--repeats", type=int, default=2, help="threaded runs of each sequence")
    parser.add_argument("--only", nargs="*", default=list(SEQUENCES), help="names of sequences")
    parser.add_argument("--set", nargs="*", default=[], help="options passed on, name=value")
    parser.add_argument("--no-sequential", action="store_true", help="leave out the sequential run")
    parser.add_argument("--stages", action="store_true", help="print each sequence's stage times as well")
    parser.add_argument("--out", type=Path, default=ROOT / "out/bench")
    arguments = parser.parse_args()
    shared = Path(os.environ.get("DEEPUAV_SHARED", ROOT / "../shared"))

    results = {"machine": processor(), "command": " ".join(sys.argv), "sequences": {}}
    print(f"Machine: {results['machine']}\n")
    print("| sequence | ATE (Sim3), m | frames located | maps | keyframes | frames/s | peak memory, MB | start-up, s | identical |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name in arguments.only:
        dataset = shared / "data" / name
        if not dataset.is_dir():
            print(f"| `{name}` | skipped: not in {shared}/data | | | | | | | |")
            continue
        schedules = ["threaded"] * arguments.repeats + ([] if arguments.no_sequential else ["sequential"])
        runs = [run_once(dataset, name, schedule, arguments, arguments.out / f"{name}-{i}-{schedule}")
                for i, schedule in enumerate(schedules)]
        results["sequences"][name] = runs
        print(table_row(name, runs), flush=True)
    if arguments.stages:
        for name, runs in results["sequences"].items():
            print(f"\n{name}, {runs[0]['schedule']}:\n\n{stage_table(runs[0])}")
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "results.json").write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
