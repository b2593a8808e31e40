"""What the tests of commands share: the program, a folder and a cache for it, and what it may say and write."""
import collections
import csv
import json
import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path

from program_under_test import FAILURE, command

LOG_LINE = re.compile(r"(info|warning|error): ")
OUTPUT_FILES = {"trajectory.txt", "keyframes.txt", "points.ply", "map.deepuav", "frames.csv", "poses.csv", "timings.csv",
                "options.yaml", "camera.yaml", "summary.json"}
REPRODUCIBLE_FILES = ("trajectory.txt", "keyframes.txt", "points.ply", "map.deepuav", "frames.csv", "poses.csv")

SHARED = Path(os.environ.get("DEEPUAV_SHARED", "/nowhere"))
MODEL = SHARED / "models/superpoint_coco.onnx"
SEQUENCE = SHARED / "data/euroc_mh01_excerpt"
scratch = tempfile.TemporaryDirectory(prefix="deepuav-command-test-")
SCRATCH = Path(scratch.name)
# The first run compiles the network, the others find it there; and the user's own cache stays as it is.
ENVIRONMENT = dict(os.environ, XDG_CACHE_HOME=str(SCRATCH / "cache"))

needs_shared = unittest.skipUnless(MODEL.is_file() and SEQUENCE.is_dir(),
                                   "no network and sequence in $DEEPUAV_SHARED")


def call(*arguments, **options):
    return subprocess.run(command(*arguments), capture_output=True, text=True, env=ENVIRONMENT, timeout=200,
                          check=False, **options)


def run_arguments(dataset, out, *more):
    return ("run", dataset, "--out", out, "--set", f"features.model={MODEL}", "--set", "features.keypoints=400",
            *more)


def summary_of(out):
    return json.loads((out / "summary.json").read_text())


class CommandTest(unittest.TestCase):
    def setUp(self):
        self.folder = SCRATCH / self.id().rsplit(".", 1)[-1]
        self.folder.mkdir()
        self.out = self.folder / "out"

    def check_stderr(self, result, expect_error):
        """Nothing but log lines, and behind them one line of the program where it failed."""
        lines = result.stderr.splitlines()
        own = [line for line in lines if not LOG_LINE.match(line)]
        self.assertEqual(len(own), 1 if expect_error else 0, result.stderr)
        if expect_error:
            self.assertEqual(own, lines[-1:])
            self.assertTrue(own[0].startswith("deepuav: "), own[0])
        self.assertNotIn("\r", result.stderr)
        self.assertNotIn("\x1b", result.stderr)

    def expect_failure(self, result, *parts, status=FAILURE):
        self.assertEqual(result.returncode, status, result.stderr)
        self.check_stderr(result, expect_error=True)
        for part in parts:
            self.assertIn(part, result.stderr.splitlines()[-1])

    def expect_success(self, result):
        self.assertEqual(result.returncode, 0, result.stderr)
        self.check_stderr(result, expect_error=False)

    def check_output(self, out):
        """All files are there and readable, nothing else is; gives the summary."""
        self.assertEqual({file.name for file in out.iterdir() if not file.name.startswith("trajectory-map-")},
                         OUTPUT_FILES)
        summary = summary_of(out)
        frames = summary["frames"]
        self.assertEqual(frames["located"] + frames["lost"], frames["processed"])
        main = [m for m in summary["maps"] if m["id"] == summary["main_map"]]
        self.assertEqual(len(self.check_poses(out / "trajectory.txt")), main[0]["frames"] if main else 0)
        self.assertEqual(len(self.check_poses(out / "keyframes.txt")), main[0]["keyframes"] if main else 0)
        points = re.match(rb"ply\n.*?element vertex (\d+)\n.*?end_header\n", (out / "points.ply").read_bytes(), re.S)
        self.assertEqual(int(points[1]), main[0]["landmarks"] if main else 0)
        self.check_frames(out / "frames.csv", summary)
        rows = (out / "timings.csv").read_text().splitlines()
        self.assertEqual(rows[0], "stage,call,milliseconds")
        self.assertEqual(len(rows) - 1, sum(stage["count"] for stage in summary["stages"].values()))
        return summary

    def check_frames(self, file, summary):
        with file.open(newline="") as table:
            rows = list(csv.DictReader(table))
        states = collections.Counter(row["state"] for row in rows)
        frames = summary["frames"]
        self.assertEqual(states["tracked"], frames["tracked_online"])
        self.assertEqual(states["tracked"] + states["located"] + states["inferred"], frames["located"])
        self.assertEqual(states["inferred"], frames["inferred"])
        self.assertEqual(states["initialising"] + states["lost"], frames["lost"])
        for row in rows:
            self.assertEqual(row["map"] != "", row["state"] in ("tracked", "located", "inferred"))
            self.assertLessEqual(int(row["landmarks"]), int(row["key_points"]))
        keyframes = [int(row["keyframe"]) for row in rows if row["keyframe"]]
        self.assertEqual(len(keyframes), sum(m["keyframes"] for m in summary["maps"]))
        self.assertEqual(keyframes, sorted(set(keyframes)))
        in_maps = collections.Counter(int(row["map"]) for row in rows if row["map"])
        self.assertEqual(in_maps, collections.Counter({m["id"]: m["frames"] for m in summary["maps"]}))

    def check_poses(self, file):
        rows = [[float(x) for x in line.split()] for line in file.read_text().splitlines() if line[0] != "#"]
        for row in rows:
            self.assertEqual(len(row), 8)
            self.assertAlmostEqual(sum(q * q for q in row[4:]), 1, places=6)
        self.assertEqual([row[0] for row in rows], sorted({row[0] for row in rows}))
        return rows
