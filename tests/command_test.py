#!/usr/bin/env python3
"""The program as its users meet it: exit statuses, messages, output folders, signals, damaged data.

  command_test.py DEEPUAV

What needs the network or the sequences looks for them in $DEEPUAV_SHARED, and the whole exits with 77, which ctest
shows as skipped, where they are absent and the rest passed.
"""
import collections
import csv
import fcntl
import json
import os
import pty
import random
import re
import resource
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import time
import unittest
from pathlib import Path

import command_test_data as data

SKIPPED = 77
FAILURE, WRONG_USE = 1, 2
LOG_LINE = re.compile(r"(info|warning|error): ")
OUTPUT_FILES = {"trajectory.txt", "keyframes.txt", "points.ply", "map.deepuav", "frames.csv", "timings.csv",
                "options.yaml", "camera.yaml", "summary.json"}
REPRODUCIBLE_FILES = ("trajectory.txt", "keyframes.txt", "points.ply", "map.deepuav", "frames.csv")

DEEPUAV = None
SHARED = Path(os.environ.get("DEEPUAV_SHARED", "/nowhere"))
MODEL = SHARED / "models/superpoint_coco.onnx"
SEQUENCE = SHARED / "data/euroc_mh01_excerpt"
scratch = tempfile.TemporaryDirectory(prefix="deepuav-command-test-")
SCRATCH = Path(scratch.name)
# The first run compiles the network, the others find it there; and the user's own cache stays as it is.
ENVIRONMENT = dict(os.environ, XDG_CACHE_HOME=str(SCRATCH / "cache"))

needs_shared = unittest.skipUnless(MODEL.is_file() and SEQUENCE.is_dir(),
                                   "no network and sequence in $DEEPUAV_SHARED")


def command(*arguments):
    return [DEEPUAV, *map(os.fspath, arguments)]


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


class Usage(CommandTest):
    def test_help_and_version(self):
        for arguments in (["--help"], ["run", "--help"], ["eval", "--help"], ["--version"]):
            result = call(*arguments)
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            self.assertTrue(result.stdout)
        self.assertIn("Example", call("run", "--help").stdout)
        self.assertIn("Example", call("eval", "--help").stdout)

    def test_wrong_use(self):
        run = ["run", "nowhere", "--out", self.out, "--set", "features.model=x"]
        for arguments, named in (([], "subcommand"), (["fly"], "unknown command 'fly'"), (["evl"], "'eval'"),
                                 (["map", "exprt"], "'export'"), (["bench", "network"], "'networks'"),
                                 (["run"], "DATASET"), (["run", "", "--out", "x"], "DATASET"),
                                 (["run", "x", "--out", ""], "--out"), (["demo", "--frames", "0"], "--frames"),
                                 (["run", "x"], "--out"),
                                 (["eval"], "TRUTH"), ([*run, "--nonsense"], "--nonsense"),
                                 ([*run, "--stride", "0"], "--stride"), ([*run, "--start", "-1"], "--start"),
                                 ([*run, "--end", "-2"], "--end"), ([*run, "--end", "x"], "--end"),
                                 ([*run, "--schedule", "later"], "later"), ([*run, "--use", "camera,radar"], "radar"),
                                 ([*run, "--use", "gnss"], "camera"), ([*run, "--use", "camera,barometer"], "gnss"),
                                 ([*run, "--log-level", "loud"], "loud"),
                                 (["eval", SCRATCH, __file__, "--rpe-delta", "0"], "above 0"),
                                 (["eval", SCRATCH, __file__, "--start", "-1"], "at least 0"),
                                 (["eval", SCRATCH, __file__, "--align", "so3"], "so3")):
            with self.subTest(arguments=arguments):
                self.expect_failure(call(*arguments), named, status=WRONG_USE)

    def test_wrong_options(self):
        model = "features.model=x"
        for assignments, parts in ((["featurs.keypoints=9", model], ["'featurs.keypoints'", "'features.keypoints'"]),
                                   (["features.keypoints=many", model], ["features.keypoints", "whole number"]),
                                   (["features.keypoints=0", model], ["option features.keypoints is 0: expected 1 to 20000"]),
                                   (["features.threshold=nan", model], ["features.threshold"]),
                                   (["features.keypoints", model], ["name=value"]),
                                   (["inference.precision=fp12", model], ["inference.precision", "bf16"]),
                                   (["matching.method=magic", model], ["matching.method", "superglue"]),
                                   (["matching.method=superglue", "superglue.precision=fp8"],
                                    ["superglue.precision", "bf16"]),
                                   (["matching.method=superglue", "superglue.min_score=2"], ["superglue.min_score"]),
                                   (["superglue.min_score=2"], ["superglue.min_score"]),
                                   (["matching.method=superglue", "matching.ratio=5"], ["matching.ratio"]),
                                   (["looping.verifier.place.max_keyframes=0", model],
                                    ["option looping.verifier.place.max_keyframes is 0: expected 2 to"]),
                                   (["mapping.local_bundle.max_iterations=-1", model],
                                    ["option mapping.local_bundle.max_iterations is -1: expected 0 to"]),
                                   (["tracking.motion_only.rounds=2147483647", model],
                                    ["option tracking.motion_only.rounds is 2147483647: expected 1 to"]),
                                   (["features.size=huge"], ["'huge'", "small"])):
            with self.subTest(assignments=assignments):
                sets = [word for assignment in assignments for word in ("--set", assignment)]
                self.expect_failure(call("run", "nowhere", "--out", self.out, *sets), *parts, status=WRONG_USE)
        self.assertFalse(self.out.exists())

    def test_localising_without_places(self):
        for assignment in ("places.vocabulary=", "looping.enabled=false"):
            with self.subTest(assignment=assignment):
                self.expect_failure(call("run", "nowhere", "--out", self.out, "--map", "nowhere", "--localise-only",
                                         "--set", assignment), "system.localise_only", "looping.enabled",
                                    status=WRONG_USE)

    def test_wrong_options_file(self):
        file = self.folder / "options.yaml"
        run = ["run", "nowhere", "--out", self.out, "--config", file]
        self.expect_failure(call(*run), "options.yaml", status=WRONG_USE)
        file.write_text("features:\n  model: x\n  keypoint: 3\n")
        self.expect_failure(call(*run), "options.yaml:3", "'features.keypoint'", "'features.keypoints'",
                            status=WRONG_USE)


    def test_full_disk_behind_stdout(self):
        for arguments in (["simulate", "--list"], ["models", "--json"], ["--help"]):
            with self.subTest(arguments=arguments), open("/dev/full", "w", encoding="utf-8") as full:
                result = subprocess.run(command(*arguments), stdout=full, stderr=subprocess.PIPE, text=True,
                                        env=ENVIRONMENT, timeout=200, check=False)
                self.assertEqual((result.returncode, result.stderr), (FAILURE, "deepuav: stdout: cannot be written\n"))


class WrongInput(CommandTest):
    """Nothing here comes as far as the network."""

    def expect_refused(self, dataset, *parts, more=()):
        self.expect_failure(call("run", dataset, "--out", self.out, "--set", "features.model=x.onnx", *more), *parts)
        self.assertFalse(self.out.exists())

    def test_no_dataset(self):
        self.expect_refused(self.folder / "absent", "absent", "no such file or folder")
        (self.folder / "empty").mkdir()
        self.expect_refused(self.folder / "empty", "empty")
        (self.folder / "empty/folder").mkdir()
        self.expect_refused(self.folder / "empty", "no known layout")
        (self.folder / "notes.txt").write_text("no dataset")
        self.expect_refused(self.folder / "notes.txt", "notes.txt", "video")
        (self.folder / "film.mp4").write_text("no film")
        (self.folder / "film.yaml").write_text(data.camera_yaml())
        self.expect_refused(self.folder / "film.mp4", "film.mp4", "does not begin like a video")
        self.expect_refused(self.folder / "two\nlines", "two?lines")

    def test_a_list_of_files_is_no_video(self):
        """FFmpeg would follow it, whatever it is called."""
        secret = self.folder / "secret.avi"
        secret.write_bytes(data.mjpeg_avi([data.png(64, 48)], 10))
        for text in (f"#EXTM3U\n#EXTINF:1,\n{secret}\n", f"ffconcat version 1.0\nfile {secret}\n",
                     f"<?xml version='1.0'?><MPD><BaseURL>{secret}</BaseURL></MPD>"):
            film = self.folder / "film.mp4"
            film.write_text(text)
            (self.folder / "film.yaml").write_text(data.camera_yaml(64, 48, (50, 50, 31.5, 23.5)))
            self.expect_refused(film, "film.mp4", "does not begin like a video")

    def test_named_pipes_are_not_waited_for(self):
        pipe = self.folder / "pipe"
        os.mkfifo(pipe)
        good = self.folder / "good.txt"
        good.write_text("".join(f"{t} {t * t} {t} 0 0 0 0 1\n" for t in range(9)))
        dataset = data.small_euroc(self.folder / "dataset")
        film = self.folder / "film.mp4"
        film.symlink_to(pipe)
        (self.folder / "film.yaml").write_text(data.camera_yaml())
        for arguments in (["eval", pipe, good], ["eval", good, pipe], ["map", "info", pipe],
                          ["run", dataset, "--out", self.out, "--camera", pipe, "--set", "features.model=x.onnx"],
                          ["run", film, "--out", self.out, "--set", "features.model=x.onnx"],
                          ["run", dataset, "--out", self.out, "--map", pipe, "--set", "features.model=x.onnx"]):
            with self.subTest(arguments=arguments):
                self.expect_failure(call(*arguments), "pipe", "expected a file")
        self.expect_failure(call("run", dataset, "--out", self.out, "--config", pipe), "is a named pipe",
                            status=WRONG_USE)
        for name in ("model", "vocabulary"):
            option = {"model": "features.model", "vocabulary": "places.vocabulary"}[name]
            self.expect_failure(call("run", dataset, "--out", self.out, "--set", f"{option}={pipe}"), "pipe")

    def test_a_named_pipe_among_photographs_is_left_out(self):
        photographs = self.folder / "photographs"
        photographs.mkdir()
        for i in range(3):
            (photographs / f"{i}.png").write_bytes(data.png(64, 48))
        os.mkfifo(photographs / "3.png")
        (photographs / "camera.yaml").write_text(data.camera_yaml(64, 48, (50, 50, 31.5, 23.5)))
        result = call("run", photographs, "--out", self.out, "--set", "places.vocabulary=")
        self.assertIn("3.png: is a named pipe", result.stderr)
        self.expect_failure(result, "no map was started")

    def test_what_a_shell_pipes_in_is_read(self):
        result = call("run", "nowhere", "--out", self.out, "--config", "/dev/stdin", input="features:\n  keypoint: 3\n")
        self.expect_failure(result, "/dev/stdin:2", "'features.keypoint'", status=WRONG_USE)

    def test_no_output_is_called_dash(self):
        dataset = data.small_euroc(self.folder / "dataset")
        for arguments in (["run", dataset, "--out", "-"], ["simulate", "--flight", "orbit", "--out", "-"],
                          ["map", "export", "x.deepuav", "--format", "ply", "--out", "-"],
                          ["map", "merge", "a.deepuav", "b.deepuav", "--out", "-"]):
            with self.subTest(arguments=arguments):
                self.expect_failure(call(*arguments, cwd=self.folder), "--out", "is '-': expected a path", status=WRONG_USE)
        self.assertFalse((self.folder / "-").exists())

    def test_no_sensor(self):
        dataset = data.small_euroc(self.folder / "dataset")
        self.expect_failure(call("run", dataset, "--out", self.out, "--use", "camera,gnss"), "has no gnss")

    def test_no_network(self):
        dataset = data.small_euroc(self.folder / "dataset")
        self.expect_failure(call("run", dataset, "--out", self.out, "--set", "features.model=absent.onnx"),
                            "absent.onnx", "no such file")
        (self.folder / "false.onnx").write_text("no network")
        self.expect_failure(call("run", dataset, "--out", self.out, "--set",
                                 f"features.model={self.folder}/false.onnx"), "false.onnx", "no network")

    def test_wrong_calibration(self):
        for name, parts, wrong in (
                ("negative", ["sensor.yaml", "fx"], {"fx": -50}),
                ("absurd", ["sensor.yaml", "distortion moves the edge"], {"distortion": "[1e10, 1e10, 0, 0]"}),
                ("count", ["sensor.yaml:12", "distortion_coefficients holds 3"], {"distortion": "[0.1, 0, 0]"}),
                ("text", ["sensor.yaml:12", "distortion_coefficients[1]"], {"distortion": "[0.1, x, 0, 0]"}),
                ("size", ["100.png", "64x48", "80x48", "sensor.yaml"], {"width": 80}),
                ("centre", ["sensor.yaml", "cx"], {"width": 8})):
            with self.subTest(name):
                self.expect_refused(data.small_euroc(self.folder / name, **wrong), *parts)
        right = data.small_euroc(self.folder / "right")
        camera = self.folder / "camera.yaml"
        camera.write_text(data.camera_yaml())
        self.expect_refused(right, "100.png", "64x48", "752x480", "camera.yaml", more=["--camera", camera])
        camera.write_text(data.camera_yaml().replace("fx", "focal"))
        self.expect_refused(right, "camera.yaml:4", "focal", more=["--camera", camera])
        (right / "mav0/cam0/sensor.yaml").unlink()
        self.expect_refused(right, "sensor.yaml", "no calibration")

    def test_wrong_list_of_frames(self):
        self.expect_refused(data.small_euroc(self.folder / "backwards", times=(100, 300, 200)), "data.csv:4",
                            "200 ns", "300 ns")
        twice = data.small_euroc(self.folder / "twice", times=(100, 200))
        data.write_euroc_list(twice, [(100, "100.png"), (100, "200.png")])
        self.expect_refused(twice, "data.csv:3", "growing times")
        data.write_euroc_list(twice, [(100, "100.png"), ("soon", "200.png")])
        self.expect_refused(twice, "data.csv:3", "'soon'")
        data.write_euroc_list(twice, [])
        self.expect_refused(twice, "data.csv", "no frame")

    def test_no_image_can_be_read(self):
        dataset = data.small_euroc(self.folder / "dataset")
        for file in (dataset / "mav0/cam0/data").iterdir():
            file.write_bytes(file.read_bytes()[:100])
        self.expect_refused(dataset, "none of the 3 images can be read", "100.png", "breaks off after 100 bytes")

    def test_range_without_a_frame(self):
        dataset = data.small_euroc(self.folder / "dataset")
        self.expect_refused(dataset, "--start", more=["--start", "3"])
        self.expect_refused(dataset, "--end", more=["--start", "2", "--end", "2"])

    def test_output_folder_cannot_be_made(self):
        dataset = data.small_euroc(self.folder / "dataset")
        (self.folder / "file").write_text("")
        run = ["run", dataset, "--set", "features.model=x.onnx", "--out"]
        self.expect_failure(call(*run, self.folder / "file/out"), "file/out", "output folder")
        self.expect_failure(call(*run, self.folder / "file"), "file")
        if os.geteuid() != 0:  # who may write everywhere
            closed = self.folder / "closed"
            closed.mkdir(mode=0o555)
            self.expect_failure(call(*run, closed), "closed", "Permission denied")

    def test_wrong_trajectories(self):
        good, bad = self.folder / "good.txt", self.folder / "bad.txt"
        good.write_text("".join(f"{t} {t * t} {t} 0 0 0 0 1\n" for t in range(9)))
        result = call("eval", good, good)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        bad.write_text("1 0 0 0 0 0 0 1\n2 0 0 zero 0 0 0 1\n")
        self.expect_failure(call("eval", good, bad), "bad.txt:2", "zero")
        bad.write_text("")
        self.expect_failure(call("eval", good, bad), "bad.txt")
        bad.write_text("".join(f"{t + 1000} {t} 0 0 0 0 0 1\n" for t in range(9)))
        self.expect_failure(call("eval", good, bad))
        self.expect_failure(call("eval", good, good, "--json", self.folder / "absent/figures.json"), "figures.json")
        text = good.read_text()
        for option in ("--plot", "--json"):
            self.expect_failure(call("eval", good, good, option, good), "good.txt", "is the input")
        self.assertEqual(good.read_text(), text)
        self.expect_failure(call("eval", good, good, "--plot", self.folder / "absent/plot.svg"), "plot.svg")
        self.expect_failure(call("eval", self.folder / "absent.txt", good), "absent.txt")
        self.expect_failure(call("eval", good, self.folder / "absent.txt"), "absent.txt")
        self.expect_failure(call("train-vocab", self.folder / "absent", "--out", "x"), "absent")


@needs_shared
class Run(CommandTest):
    @classmethod
    def setUpClass(cls):
        frames = data.euroc_frames(SEQUENCE)
        cls.frames = frames[60:140:2]
        cls.flight = data.euroc_part(SCRATCH / "flight", SEQUENCE, cls.frames)
        cls.short_frames = frames[60:108:4]
        cls.short = data.euroc_part(SCRATCH / "short", SEQUENCE, cls.short_frames)
        cls.short_out = SCRATCH / "short-out"
        cls.short_result = call(*run_arguments(cls.short, cls.short_out))

    def test_short_run(self):
        """What the other tests compare with."""
        self.expect_success(self.short_result)
        self.assertIn("map 0: ", self.short_result.stdout)
        summary = self.check_output(self.short_out)
        self.assertEqual(summary["frames"]["images"], len(self.short_frames))
        self.assertFalse(summary["stopped_early"])

    def test_options_of_a_run_repeat_it(self):
        self.expect_success(call("run", self.short, "--out", self.out, "--config", self.short_out / "options.yaml"))
        self.assertEqual(summary_of(self.out)["options"], summary_of(self.short_out)["options"])
        for name in (*REPRODUCIBLE_FILES, "options.yaml"):
            self.assertEqual((self.out / name).read_bytes(), (self.short_out / name).read_bytes(), name)

    def test_schedules_give_the_same_bytes(self):
        outs = []
        for name, schedule in (("first", "threaded"), ("second", "threaded"), ("third", "sequential")):
            outs.append(self.folder / name)
            self.expect_success(call(*run_arguments(self.flight, outs[-1], "--schedule", schedule)))
        summary = self.check_output(outs[0])
        self.assertGreater(summary["frames"]["located"], len(self.frames) // 2)
        for other in outs[1:]:
            for name in REPRODUCIBLE_FILES:
                self.assertEqual((outs[0] / name).read_bytes(), (other / name).read_bytes(), f"{other.name}/{name}")
        result = call("eval", SEQUENCE, outs[0] / "trajectory.txt", "--json", "-")
        self.expect_success(result)
        self.assertTrue(json.loads(result.stdout))

    def test_damaged_images_are_left_out_and_counted(self):
        dataset = data.euroc_part(self.folder / "dataset", SEQUENCE, self.frames)
        images = dataset / "mav0/cam0/data"
        names = [file.name for _, file in self.frames]
        for index, kept in ((5, 20000), (11, 3000), (12, 100), (27, 0), (38, 25000)):
            data.replace(images / names[index], (images / names[index]).read_bytes()[:kept])
        data.replace(images / names[20], None)
        bad = [5, 11, 12, 20, 27, 38]
        result = call(*run_arguments(dataset, self.out))
        self.expect_success(result)
        frames = self.check_output(self.out)["frames"]
        self.assertEqual(frames["images"], len(self.frames))
        self.assertEqual(frames["unreadable"], len(bad))
        self.assertEqual(frames["processed"], len(self.frames) - len(bad))
        self.assertGreater(frames["located"], len(self.frames) // 2)
        warnings = [line for line in result.stderr.splitlines() if line.startswith("warning: ")]
        self.assertEqual(len(warnings), len(bad), result.stderr)
        for index, warning in zip(bad, warnings):
            self.assertIn(f"frame {index} ", warning)
            self.assertIn(names[index], warning)

        nothing_left = call(*run_arguments(dataset, self.folder / "none", "--start", "11", "--end", "13"))
        self.expect_failure(nothing_left, "no image could be read")
        self.assertEqual(self.check_output(self.folder / "none")["frames"]["unreadable"], 2)

    def stop_once_a_map_is_there(self, sent, schedule):
        process = subprocess.Popen(command(*run_arguments(self.flight, self.out, "--schedule", schedule)),
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
        for line in process.stderr:
            if "map 0 starts" in line:
                break
        process.send_signal(sent)
        process.communicate(timeout=100)
        summary = self.check_output(self.out)
        self.assertTrue(summary["stopped_early"])
        self.assertLess(summary["frames"]["processed"], len(self.frames))
        self.assertGreater(summary["frames"]["located"], 0)
        return process.returncode

    def test_interrupted(self):
        self.assertEqual(self.stop_once_a_map_is_there(signal.SIGINT, "threaded"), 130)

    def test_terminated(self):
        self.assertEqual(self.stop_once_a_map_is_there(signal.SIGTERM, "sequential"), 143)

    def test_the_terminal_went_away(self):
        self.assertEqual(self.stop_once_a_map_is_there(signal.SIGHUP, "threaded"), 129)

    def test_what_nohup_started_goes_on(self):
        process = subprocess.Popen(["nohup", *command(*run_arguments(self.short, self.out))],
                                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                   text=True, env=ENVIRONMENT)
        for line in process.stderr:
            if "map 0 starts" in line:
                break
        process.send_signal(signal.SIGHUP)
        process.communicate(timeout=100)
        self.assertEqual(process.returncode, 0)
        self.assertFalse(self.check_output(self.out)["stopped_early"])

    def test_two_runs_at_once_into_one_folder_are_refused(self):
        first = subprocess.Popen(command(*run_arguments(self.flight, self.out)), stdout=subprocess.DEVNULL,
                                 stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
        for line in first.stderr:
            if "map 0 starts" in line:
                break
        self.expect_failure(call(*run_arguments(self.short, self.out)), "another deepuav is writing into it")
        first.kill()
        first.communicate()

    def test_killed_leaves_whole_files_or_none(self):
        generator = random.Random(1)
        for attempt in range(8):
            out = self.folder / f"out{attempt}"
            process = subprocess.Popen(command(*run_arguments(self.short, out)), stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL, env=ENVIRONMENT)
            if attempt < 6:
                self.wait_for_writing(process, out)
                time.sleep(generator.uniform(0, 0.03))
            else:
                time.sleep(generator.uniform(0.2, 1))
            process.kill()
            process.wait()
            self.check_whole(out)

    def wait_for_writing(self, process, out):
        probe = f".deepuav-{process.pid}-0.tmp"  # of the check that files can be made
        while process.poll() is None:
            if out.exists() and any(name != probe for name in os.listdir(out)):
                return
            time.sleep(0.0005)

    def check_whole(self, out):
        names = set(os.listdir(out)) if out.exists() else set()
        names = {name for name in names if not re.fullmatch(r"\.deepuav-\d+-\d+\.tmp", name)}
        self.assertLessEqual(names, OUTPUT_FILES)
        for name in names.intersection(REPRODUCIBLE_FILES):
            self.assertEqual((out / name).read_bytes(), (self.short_out / name).read_bytes(), f"{out}/{name}")
        if "summary.json" in names:
            self.assertEqual(summary_of(out)["frames"], summary_of(self.short_out)["frames"])
        if "timings.csv" in names:
            rows = [file.read_text().splitlines() for file in (out / "timings.csv", self.short_out / "timings.csv")]
            self.assertEqual(len(rows[0]), len(rows[1]))

    def test_live_keeps_the_pace_and_counts_what_it_skips(self):
        """Of three images within 2 ms the second is overtaken on any machine."""
        triples, gap_s = 13, 0.25
        times = [10**9 + round(triple * gap_s * 1e9) + 10**6 * i for triple in range(triples) for i in range(3)]
        dataset = data.euroc_part(self.folder / "dataset", SEQUENCE, self.frames[:len(times)], times)
        began = time.monotonic()
        result = call(*run_arguments(dataset, self.out, "--schedule", "live"))
        took_s = time.monotonic() - began
        if result.returncode != 0:  # a slow machine skips too much
            self.expect_failure(result, "no map was started")
        frames = self.check_output(self.out)["frames"]
        self.assertGreaterEqual(took_s, (times[-1] - times[0]) / 1e9)
        self.assertGreaterEqual(frames["skipped_late"], triples - 1)
        self.assertEqual(frames["processed"] + frames["skipped_late"], frames["images"])

    def test_every_layout(self):
        few = self.short_frames
        for kind, dataset in (("kitti", data.kitti(self.folder / "kitti", few)),
                              ("tum", data.tum(self.folder / "tum", few)),
                              ("photographs", data.photographs(self.folder / "photographs", few)),
                              ("video", data.video(self.folder / "video.avi", few))):
            with self.subTest(kind):
                out = self.folder / f"out-{kind}"
                result = call(*run_arguments(dataset, out))
                if result.returncode != 0:  # the lens is taken for a pinhole here
                    self.expect_failure(result, "no map was started")
                summary = self.check_output(out)
                self.assertEqual(summary["dataset"]["kind"], kind)
                self.assertEqual(summary["frames"]["processed"], len(few))
                self.assertEqual(summary["frames"]["unreadable"], 0)

    def test_a_video_cut_short(self):
        video = data.video(self.folder / "video.avi", self.short_frames[:6])
        video.write_bytes(video.read_bytes()[:int(0.6 * video.stat().st_size)])
        result = call(*run_arguments(video, self.out))
        if result.returncode != 0:
            self.expect_failure(result, "no map was started")
        frames = self.check_output(self.out)["frames"]
        self.assertGreaterEqual(frames["processed"], 3)
        self.assertEqual(frames["processed"] + frames["unreadable"], frames["images"])
        self.assertEqual(result.stderr.count("warning: "), frames["unreadable"])

    def test_nothing_more_fits_on_the_disk(self):
        def limit_files():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (400, 400))

        result = call(*run_arguments(self.short, self.out), preexec_fn=limit_files)
        self.expect_failure(result, str(self.out), "cannot be written")
        self.check_whole(self.out)
        self.assertFalse([name for name in os.listdir(self.out) if name.endswith(".tmp")])

    def test_options_and_names(self):
        """--set wins over --config; a file name that is no UTF-8 does no harm; nothing of an earlier run stays."""
        config = self.folder / "options.yaml"
        config.write_text("features:\n  keypoints: 300\n  threshold: 0.01\n")
        self.out.mkdir()
        (self.out / "trajectory-map-3.txt").write_text("of an earlier run\n")
        (self.out / "notes.txt").write_text("the user's own\n")
        dataset = data.link_with_bytes(self.folder, b"flight-\xff", self.flight)
        result = subprocess.run([os.fsencode(DEEPUAV), b"run", dataset, b"--out", os.fsencode(self.out), b"--config",
                                 os.fsencode(config), b"--set", b"features.model=" + os.fsencode(MODEL), b"--set",
                                 b"features.keypoints=200", b"--start", b"2", b"--end", b"9", b"--stride", b"3"],
                                capture_output=True, env=ENVIRONMENT, check=False)
        self.assertEqual(result.returncode, FAILURE)
        self.assertIn(b"no map was started", result.stderr)
        self.assertEqual({file.name for file in self.out.iterdir()}, OUTPUT_FILES | {"notes.txt"})
        summary = summary_of(self.out)
        self.assertEqual(summary["frames"]["processed"], 3)
        self.assertEqual(summary["options"]["features.keypoints"], "200")
        self.assertEqual(summary["options"]["features.threshold"], "0.01")

    def test_progress_bar_on_a_terminal(self):
        columns = 60
        try:
            terminal, end = pty.openpty()
        except OSError as error:  # a bare container may have none
            self.skipTest(f"no terminal to be had: {error}")
        fcntl.ioctl(end, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        dataset = data.euroc_part(self.folder / "dataset", SEQUENCE, self.short_frames)
        data.replace(dataset / "mav0/cam0/data" / self.short_frames[6][1].name, b"")
        process = subprocess.Popen(command(*run_arguments(dataset, self.out)), stdout=end, stderr=end, env=ENVIRONMENT)
        os.close(end)
        shown = b""
        while True:
            try:
                read = os.read(terminal, 65536)
            except OSError:  # how Linux tells that nobody holds the other end
                break
            if not read:
                break
            shown += read
        os.close(terminal)
        text = shown.decode()
        self.assertEqual(process.wait(), 0, text)
        drawn = re.findall(r"\r\x1b\[K(\[[#.]+\][^\r]*)", text)
        self.assertTrue(drawn, text)
        self.assertTrue(all(len(line) < columns for line in drawn), drawn)
        self.assertRegex(drawn[-1], r"^\[#+\] 12/12  [\d.]+ frames/s")
        # Log and result have lines of their own.
        self.assertRegex(text, r"\r\x1b\[K\S*warning\S*: frame 6 left out")
        self.assertRegex(text, r"(\n|\r\x1b\[K)map 0: ")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    DEEPUAV = str(Path(sys.argv.pop(1)).resolve())
    program = unittest.main(exit=False)
    skipped = program.result.skipped
    if skipped:
        print(f"skipped: {skipped[0][1]}")
    sys.exit(1 if not program.result.wasSuccessful() else SKIPPED if skipped else 0)
