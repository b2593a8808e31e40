#!/usr/bin/env python3
"""Kills of the program at random moments, each followed by a check that every output is whole or absent, and runs again
and again over one sequence, which must give the same bytes in the same memory.

  bench/system/robustness.py [--deepuav build/deepuav] [--kills 1000] [--repeats 20] [--seed 1]

Kills take turns over `run`, `simulate`, `map merge` and `match`, by SIGKILL, SIGTERM, SIGINT and SIGHUP, at a moment
drawn evenly over what the command takes undisturbed. Prints a table for docs/results.md; exits with 1 at the first
output that is neither whole nor absent, at a temporary file that a signal other than SIGKILL leaves, and at a program
that a signal does not end within SECONDS_TO_END. The fuzzers of the readers: `ctest --preset fuzz`.
"""
import argparse
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))
import layered_scene  # noqa: E402

FRAMES, FIRST_PART = 30, 20
SECONDS_TO_END = 20
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
TEMPORARY = re.compile(r"\.deepuav-\d+-\d+\.tmp")
# What the program writes on its way, before the rest; the others must be those of a run undisturbed.
OWN_EACH_TIME = {"summary.json", "timings.csv", "options.yaml"}


class Broken(Exception):
    """An output that is neither whole nor absent, or a program that does not end."""


class Workplace:
    def __init__(self, deepuav, folder):
        self.deepuav, self.folder = deepuav, folder
        self.environment = dict(os.environ, XDG_CACHE_HOME=str(folder / "cache"))
        self.scene = layered_scene.euroc(folder / "scene", FRAMES)
        self.images = sorted((self.scene / "mav0/cam0/data").iterdir())

    def words(self, *arguments):
        return [self.deepuav, *map(os.fspath, arguments)]

    def start(self, words):
        return subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=self.environment)

    def succeed(self, words):
        """Seconds that it took."""
        began = time.monotonic()
        result = subprocess.run(words, capture_output=True, text=True, env=self.environment, check=False)
        if result.returncode != 0:
            raise Broken(f"{' '.join(words)}: {result.returncode}: {result.stderr}")
        return time.monotonic() - began


def files_of(folder):
    """{name within the folder: bytes} without temporary files."""
    return {str(file.relative_to(folder)): file.read_bytes() for file in sorted(folder.rglob("*"))
            if file.is_file() and not TEMPORARY.fullmatch(file.name)}


class Command:
    """One command: how it is called, and how its outputs are checked against those of an undisturbed call."""

    def __init__(self, place):
        self.place = place
        self.reference = place.folder / f"{self.name}-reference"
        place.succeed(self.call(self.reference))  # compiles the networks
        shutil.rmtree(self.reference)
        self.seconds = place.succeed(self.call(self.reference))
        self.wanted = files_of(self.reference)

    def check(self, out, stopped):
        """`stopped`: by a signal that lets the command save what it has."""
        for name, content in (files_of(out) if out.exists() else {}).items():
            if name not in self.wanted:
                raise Broken(f"{self.name}: {name}: no undisturbed call writes it")
            if content != self.wanted[name] and not self.is_whole(name, content, out, stopped):
                raise Broken(f"{self.name}: {name}: {len(content)} bytes, neither whole nor absent")

    def is_whole(self, name, content, out, stopped):
        """Of a file that differs from the undisturbed call's."""
        return False


class Run(Command):
    name = "run"

    def call(self, out):
        return self.place.words("run", self.place.scene, "--out", out, "--set", "features.keypoints=300", "--set",
                                "places.vocabulary=", "--log-level", "warn")

    def is_whole(self, name, content, out, stopped):
        if name == "summary.json":
            return "frames" in json.loads(content)
        if name in OWN_EACH_TIME:
            return content.endswith(b"\n")
        if not stopped:
            return False
        if name == "map.deepuav":
            self.place.succeed(self.place.words("map", "info", out / name))
        return name.endswith((".deepuav", ".ply")) or content == b"" or content.endswith(b"\n")


class Simulate(Command):
    name = "simulate"

    def call(self, out):
        options = ("camera.width=160", "camera.height=120", "camera.fx=100", "camera.fy=100", "camera.cx=79.5",
                   "camera.cy=59.5", "camera.model=pinhole", "scene.extent_m=400", "flight.duration_s=2")
        return self.place.words("simulate", "--flight", "orbit", "--out", out, "--threads", "1",
                                *(word for option in options for word in ("--set", option)))

    def is_whole(self, name, content, out, stopped):  # the list of the frames that are there
        wanted = self.wanted[name]
        return stopped and name == "mav0/cam0/data.csv" and wanted.startswith(content) and content.endswith(b"\n")


class Merge(Command):
    name = "map merge"

    def __init__(self, place):
        self.maps = []
        for index, part in enumerate((("--end", str(FIRST_PART)), ("--start", str(FRAMES - FIRST_PART)))):
            out = place.folder / f"part{index}"
            place.succeed(place.words("run", place.scene, "--out", out, "--set", "features.keypoints=300", *part))
            self.maps.append(out / "map.deepuav")
        super().__init__(place)

    def call(self, out):
        out.mkdir(exist_ok=True)
        return self.place.words("map", "merge", *self.maps, "--out", out / "both.deepuav", "--log-level", "warn")


class Match(Command):
    name = "match"

    def call(self, out):
        pairs = self.place.folder / "pairs.txt"
        images = self.place.images
        pairs.write_text("".join(f"{a} {b}\n" for a, b in zip(images, images[2:])))
        return self.place.words("match", "--pairs", pairs, "--out", out, "--draw", "--set", "superglue.keypoints=200")


def kill_once(command, sent, generator):
    """Seconds from the signal to the end; None where the command was done before."""
    out = command.place.folder / "killed"
    shutil.rmtree(out, ignore_errors=True)
    process = command.place.start(command.call(out))
    time.sleep(generator.uniform(0, command.seconds))
    done = process.poll() is not None
    process.send_signal(sent)
    began = time.monotonic()
    try:
        status = process.wait(timeout=SECONDS_TO_END)
    except subprocess.TimeoutExpired:
        process.kill()
        raise Broken(f"{command.name}: alive {SECONDS_TO_END} s after {sent.name}") from None
    took = time.monotonic() - began
    if status not in (0, -sent, 128 + sent):
        raise Broken(f"{command.name}: exit status {status} after {sent.name}")
    command.check(out, stopped=sent != signal.SIGKILL)
    left = [file.name for file in out.rglob("*") if TEMPORARY.fullmatch(file.name)] if out.exists() else []
    if left and sent != signal.SIGKILL:
        raise Broken(f"{command.name}: {sent.name} left {', '.join(left)}")
    return None if done else took


def kill_all(place, kills, seed):
    generator = random.Random(seed)
    commands = [kind(place) for kind in (Run, Simulate, Merge, Match)]
    print("| command | kills | before its end | slowest to end, s |\n|---|---|---|---|")
    for command in commands:
        times = []
        count = kills // len(commands)
        for i in range(count):
            times.append(kill_once(command, SIGNALS[i % len(SIGNALS)], generator))
        ended = [took for took in times if took is not None]
        print(f"| `{command.name}` | {count} | {len(ended)} | {max(ended, default=0):.2f} |", flush=True)


def repeat(place, repeats):
    """The same run again and again: the same bytes, in how much memory."""
    command = Run(place)
    peaks = []
    for _ in range(repeats):
        out = place.folder / "repeated"
        shutil.rmtree(out, ignore_errors=True)
        place.succeed(command.call(out))
        for name, content in files_of(out).items():
            if name not in OWN_EACH_TIME and content != command.wanted[name]:
                raise Broken(f"run: {name} differs from one run to the next")
        peaks.append(json.loads((out / "summary.json").read_text())["peak_resident_mb"])
    print(f"\n{repeats} runs: the same bytes; peak memory {min(peaks):.0f} to {max(peaks):.0f} MB")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--deepuav", default=str(ROOT / "build/deepuav"))
    parser.add_argument("--kills", type=int, default=1000)
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="deepuav-robustness-") as folder:
        place = Workplace(arguments.deepuav, Path(folder))
        try:
            if arguments.kills:
                kill_all(place, arguments.kills, arguments.seed)
            if arguments.repeats:
                repeat(place, arguments.repeats)
        except Broken as broken:
            sys.exit(f"robustness.py: {broken}")


if __name__ == "__main__":
    main()
