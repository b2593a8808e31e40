#!/usr/bin/env python3
"""Saved maps as their users meet them: `deepuav map`, what other programs make of its exports, and runs killed while
a good map lies in their output folder.

  map_command_test.py DEEPUAV

Exits with 77, which ctest shows as skipped, where COLMAP or laspy are absent and the rest passed.
"""
import hashlib
import json
import os
import random
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import layered_scene

SKIPPED = 77
FAILURE, WRONG_USE = 1, 2
ROOT = Path(__file__).resolve().parent.parent
MODEL = ROOT / "models/superpoint_small.onnx"
OLD_FRAMES, NEW_FRAMES = 14, 24
KILLS = 15
HEADER_BYTES = 12

DEEPUAV = None
scratch = tempfile.TemporaryDirectory(prefix="deepuav-map-test-")
SCRATCH = Path(scratch.name)
SCENE, OLD, NEW = SCRATCH / "scene", SCRATCH / "old", SCRATCH / "new"
# The first run compiles the network, the others find it there; and the user's own cache stays as it is.
ENVIRONMENT = dict(os.environ, XDG_CACHE_HOME=str(SCRATCH / "cache"))


def command(*arguments):
    return [DEEPUAV, *map(os.fspath, arguments)]


def call(*arguments):
    return subprocess.run(command(*arguments), capture_output=True, text=True, env=ENVIRONMENT, timeout=200,
                          check=False)


def run_arguments(dataset, out, *more):
    return ("run", dataset, "--out", out, "--set", f"features.model={MODEL}", "--set", "features.keypoints=300",
            "--set", "places.vocabulary=", "--log-level", "warn", *more)


def succeed(*arguments):
    result = call(*arguments)
    if result.returncode != 0 or result.stderr:
        raise AssertionError(f"{arguments}: {result.returncode}: {result.stderr}")
    return result.stdout


def info(file):
    return json.loads(succeed("map", "info", file, "--json"))


def python_with(module):
    """An interpreter that has the module: the one of scripts/test.sh or this one; None without."""
    for python in (ROOT / ".venv/bin/python", Path(sys.executable)):
        if python.exists() and subprocess.run([python, "-c", f"import {module}"], capture_output=True,
                                              check=False).returncode == 0:
            return python
    return None


def setUpModule():
    layered_scene.euroc(SCENE, NEW_FRAMES)
    succeed(*run_arguments(SCENE, OLD, "--end", str(OLD_FRAMES)))
    succeed(*run_arguments(SCENE, NEW))


class MapTest(unittest.TestCase):
    def setUp(self):
        self.folder = SCRATCH / self.id().rsplit(".", 1)[-1]
        self.folder.mkdir()
        self.map = NEW / "map.deepuav"

    def expect_failure(self, arguments, *parts, status=FAILURE):
        result = call(*arguments)
        self.assertEqual(result.returncode, status, result.stderr)
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        self.assertTrue(result.stderr.startswith("deepuav: "), result.stderr)
        self.assertEqual(result.stdout, "")
        for part in parts:
            self.assertIn(part, result.stderr)

    def export(self, form, name, *more, file=None):
        out = self.folder / name
        succeed("map", "export", file or self.map, "--format", form, "--out", out, *more)
        return out


class GoingOn(MapTest):
    """Runs over a map of an earlier one; the same images again have the same time stamps."""

    def go_on(self, *more, features=()):
        out = self.folder / "again"
        arguments = run_arguments(SCENE, out, "--map", OLD / "map.deepuav", *features, "--set",
                                  f"places.vocabulary={ROOT / 'models/vocabulary.bin'}", *more)
        return out, call(*arguments)

    def test_the_same_flight_again(self):
        out, result = self.go_on()
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        summary = json.loads((out / "summary.json").read_text())
        held = [one["id"] for one in info(out / "map.deepuav")["maps"]]
        self.assertEqual([one["id"] for one in summary["maps"]], held)
        self.assertIn(summary["main_map"], held)
        self.assertTrue(Path(summary["dataset"]["path"]).is_absolute())
        stamps = [float(line.split()[0]) for line in (out / "keyframes.txt").read_text().splitlines() if line[0] != "#"]
        self.assertEqual(stamps, sorted(set(stamps)))
        rows = [line.split(",") for line in (out / "frames.csv").read_text().splitlines()[1:]]
        self.assertEqual(len([row for row in rows if row[6] and int(row[3]) == summary["main_map"]]), len(stamps))
        succeed("report", out, "--html", self.folder / "page.html")

    def test_only_localising_leaves_the_file_as_it_is(self):
        out, result = self.go_on("--localise-only", features=(
            "--set", f"features.model={MODEL.with_name('superpoint_small_int8.onnx')}"))
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("continued with superpoint_small_int8.onnx", result.stderr)
        self.assertEqual((out / "map.deepuav").read_bytes(), (OLD / "map.deepuav").read_bytes())

    def test_a_map_of_two_networks_names_both(self):
        int8 = MODEL.with_name("superpoint_small_int8.onnx")
        out, _ = self.go_on(features=("--set", f"features.model={int8}"))
        features = info(out / "map.deepuav")["features"]
        self.assertTrue(features.startswith(MODEL.name), features)
        self.assertIn(int8.name, features)
        more = self.folder / "more"
        call(*run_arguments(SCENE, more, "--map", out / "map.deepuav", "--set", f"features.model={int8}", "--end", "4"))
        self.assertEqual(info(more / "map.deepuav")["features"], features)

    def test_another_camera(self):
        for scale, coefficients, status, part in (
                (1.2, "0, 0, 0, 0", FAILURE, "expected at most 10"), (1, "0.1, 0, 0, 0", FAILURE, "expected at most"),
                (1.01, "0, 0, 0, 0", 0, "its camera is taken"), (1.001, "0, 0, 0, 0", 0, "")):
            with self.subTest(scale=scale, coefficients=coefficients):
                camera = self.folder / "camera.yaml"
                focal = scale * layered_scene.FOCAL_PX
                camera.write_text(
                    f"model: radial_tangential\nwidth: {layered_scene.WIDTH}\nheight: {layered_scene.HEIGHT}\nfx: {focal}\n"
                    f"fy: {focal}\ncx: {(layered_scene.WIDTH - 1) / 2}\ncy: {(layered_scene.HEIGHT - 1) / 2}\n"
                    f"distortion: [{coefficients}]\n")
                _, result = self.go_on("--camera", camera, "--end", "2", "--localise-only")
                self.assertEqual(result.returncode, status, result.stderr)
                self.assertIn(part, result.stderr)
                self.assertEqual(bool(result.stderr), bool(part), result.stderr)


class Info(MapTest):
    def test_figures_are_those_of_the_run(self):
        figures, summary = info(self.map), json.loads((NEW / "summary.json").read_text())
        self.assertEqual(figures["program"], summary["version"])
        self.assertEqual(figures["features"], summary["features"])
        self.assertIn("sha256:" + hashlib.sha256(MODEL.read_bytes()).hexdigest(), figures["features"])
        self.assertEqual([(m["id"], m["keyframes"], m["landmarks"]) for m in figures["maps"]],
                         [(m["id"], m["keyframes"], m["landmarks"]) for m in summary["maps"]])
        main = figures["maps"][0]
        self.assertGreater(main["keyframes"], 3)
        self.assertGreater(main["landmarks"], 50)
        self.assertGreaterEqual(main["median_observations"], 2)
        self.assertGreaterEqual(main["observations"], 2 * main["landmarks"])
        self.assertEqual(figures["image_names"], main["keyframes"])
        times = [float(line.split()[0]) for line in (NEW / "keyframes.txt").read_text().splitlines()[1:]]
        self.assertAlmostEqual(main["first_time_ns"] / 1e9, times[0])
        self.assertAlmostEqual(main["last_time_ns"] / 1e9, times[-1])
        self.assertGreater(main["path_length"], 0)

    def test_sections_add_up_to_the_file(self):
        figures = info(self.map)
        self.assertEqual(figures["bytes"], self.map.stat().st_size)
        self.assertEqual(HEADER_BYTES + sum(s["file_bytes"] for s in figures["sections"].values()), figures["bytes"])
        self.assertEqual(figures["sections"]["FEAT"]["count"], sum(m["keyframes"] for m in figures["maps"]))

    def test_text(self):
        text = succeed("map", "info", self.map)
        figures = info(self.map)
        self.assertIn(f"map 0: {figures['maps'][0]['keyframes']} keyframes", text)
        self.assertIn(figures["features"], text)
        self.assertIn(f"{layered_scene.WIDTH}x{layered_scene.HEIGHT}", text)

    def test_what_is_no_map(self):
        absent, foreign, empty = (self.folder / name for name in ("absent.deepuav", "foreign.deepuav", "empty.deepuav"))
        foreign.write_bytes((NEW / "points.ply").read_bytes())
        empty.write_bytes(b"")
        for file, part in ((absent, "absent.deepuav"), (foreign, "begins with 'ply"), (empty, "empty.deepuav"),
                           (self.folder, "expected a file")):
            self.expect_failure(("map", "info", file), part)
            self.expect_failure(("map", "export", file, "--format", "ply", "--out", self.folder / "points.ply"), part)
        self.assertFalse((self.folder / "points.ply").exists())

    def test_other_versions(self):
        content, file = self.map.read_bytes(), self.folder / "other.deepuav"
        version = struct.unpack("<I", content[8:HEADER_BYTES])[0]
        for other, part in ((version + 1, "of a newer program"), (version - 2, "format version"), (2**32 - 1, "newer")):
            file.write_bytes(content[:8] + struct.pack("<I", other) + content[HEADER_BYTES:])
            self.expect_failure(("map", "info", file), "other.deepuav", part, str(other))

    def test_cut_off(self):
        content, file, generator = self.map.read_bytes(), self.folder / "cut.deepuav", random.Random(1)
        for length in (1, 11, 12, len(content) - 1, *(generator.randrange(len(content)) for _ in range(12))):
            with self.subTest(length=length):
                file.write_bytes(content[:length])
                self.expect_failure(("map", "info", file), "cut.deepuav")

    def test_flipped_bits(self):
        content, file, generator = self.map.read_bytes(), self.folder / "flipped.deepuav", random.Random(2)
        for position in (0, 8, 12, len(content) - 1, *(generator.randrange(len(content)) for _ in range(20))):
            with self.subTest(position=position):
                damaged = bytearray(content)
                damaged[position] ^= 1 << generator.randrange(8)
                file.write_bytes(damaged)
                self.expect_failure(("map", "info", file), "flipped.deepuav")


class Export(MapTest):
    def test_points_and_poses_are_those_of_the_run(self):
        self.assertEqual(self.export("ply", "points.ply").read_bytes(), (NEW / "points.ply").read_bytes())
        self.assertEqual(self.export("tum", "poses.txt").read_text(), (NEW / "keyframes.txt").read_text())

    def test_las_as_laspy_reads_it(self):
        python = python_with("laspy")
        if not python:
            self.skipTest("no laspy; scripts/test.sh installs it")
        las = self.export("las", "points.las")
        script = ("import json, laspy, sys; las = laspy.read(sys.argv[1]); print(json.dumps("
                  "[str(las.header.version), las.header.point_format.id, las.xyz.tolist(), list(las.header.mins), "
                  "list(las.header.maxs), las.red.tolist(), list(map(int, las.number_of_returns))]))")
        read = subprocess.run([python, "-c", script, las], capture_output=True, text=True, check=True)
        version, point_format, points, low, high, red, returns = json.loads(read.stdout)
        self.assertEqual((version, point_format), ("1.2", 2))
        expected = self.ply_points(NEW / "points.ply")
        self.assertEqual(len(points), len(expected))
        for point, other in zip(points, expected):
            for a, b in zip(point, other):
                self.assertAlmostEqual(a, b, delta=1e-6 * max(1, abs(b)))
        for axis in range(3):
            along = [point[axis] for point in points]
            self.assertAlmostEqual(low[axis], min(along), places=9)
            self.assertAlmostEqual(high[axis], max(along), places=9)
        self.assertEqual(set(red), {180 * 257})
        self.assertEqual(set(returns), {1})

    def test_cameras_as_csv(self):
        lines = self.export("csv", "cameras.csv").read_text().splitlines()
        poses = [line.split() for line in (NEW / "keyframes.txt").read_text().splitlines() if line[0] != "#"]
        self.assertEqual(len(lines), 1 + len(poses))
        for line, pose in zip(lines[1:], poses):
            image, time_ns, *numbers = line.split(",")
            self.assertTrue(image.endswith(".png"), line)
            self.assertAlmostEqual(int(time_ns) / 1e9, float(pose[0]), places=5)
            for a, b in zip(numbers[:3], pose[1:4]):
                self.assertAlmostEqual(float(a), float(b), places=5)
            self.assertEqual(numbers[7:], ["", "", ""])  # No place on Earth.

    def test_orthophoto_and_dsm(self):
        for form in ("orthophoto", "dsm"):
            with self.subTest(form=form):
                out = self.folder / f"{form}.tif"
                told = succeed("map", "export", self.map, "--format", form, "--out", out, "--resolution", "0.02")
                self.assertIn("cells of", told)
                self.assertIn("turned so that the ground is level", told)
                self.assertIn(out.read_bytes()[:4], (b"II*\0", b"II+\0"))
        self.assertEqual(len(list(self.folder.iterdir())), 2)

    def test_orthophoto_of_other_images(self):
        alone = self.folder / "alone.deepuav"
        shutil.copy(self.map, alone)
        arguments = ("map", "export", alone, "--format", "orthophoto", "--out", self.folder / "ortho.tif")
        self.expect_failure(arguments, "--images", "summary.json")
        self.expect_failure((*arguments, "--images", self.folder / "absent"), "absent")
        self.expect_failure((*arguments, "--resolution", "-1"), "--resolution", status=WRONG_USE)
        self.assertFalse((self.folder / "ortho.tif").exists())
        succeed(*arguments, "--images", SCENE)
        self.assertTrue((self.folder / "ortho.tif").exists())

    def ply_points(self, file):
        content = file.read_bytes()
        start = content.index(b"end_header\n") + len(b"end_header\n")
        return [record[:3] for record in struct.iter_unpack("<fffBBB", content[start:])]

    @unittest.skipUnless(shutil.which("colmap"), "no colmap")
    def test_colmap_opens_the_model(self):
        figures = info(self.map)["maps"][0]
        model = self.export("colmap", "sparse/0")
        analysis = self.colmap("model_analyzer", "--path", model)
        for line in ("Cameras: 1", f"Images: {figures['keyframes']}", f"Registered images: {figures['keyframes']}",
                     f"Points: {figures['landmarks']}", f"Observations: {figures['observations']}"):
            self.assertIn(line, analysis)
        error_px = float(re.search(r"Mean reprojection error: ([\d.]+)px", analysis)[1])
        self.assertGreater(error_px, 0.05)
        self.assertLess(error_px, 1.5)
        binary = self.folder / "binary"
        binary.mkdir()
        self.colmap("model_converter", "--input_path", model, "--output_path", binary, "--output_type", "BIN")
        self.assertIn(f"Points: {figures['landmarks']}", self.colmap("model_analyzer", "--path", binary))

        # What COLMAP computes itself from cameras, poses and points, before it adjusts anything.
        adjusted = self.folder / "adjusted"
        adjusted.mkdir()
        report = self.colmap("bundle_adjuster", "--input_path", model, "--output_path", adjusted,
                             "--BundleAdjustment.max_num_iterations", "1")
        own_rms_px = float(re.search(r"Initial cost : ([\d.]+) \[px\]", report)[1])
        self.assertAlmostEqual(own_rms_px, self.rms_px(model), delta=0.01 * own_rms_px)

    def colmap(self, *arguments):
        environment = dict(os.environ, QT_QPA_PLATFORM="offscreen")
        result = subprocess.run(["colmap", *map(os.fspath, arguments)], capture_output=True, text=True, timeout=100,
                                env=environment, check=False)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout + result.stderr

    def rms_px(self, model):
        """As COLMAP's adjuster has it: the root of half the mean square of the residuals, x and y apart."""
        lines = {name: [line.split() for line in (model / name).read_text().splitlines() if line[:1] != "#"]
                 for name in ("cameras.txt", "images.txt", "points3D.txt")}
        fx, fy, cx, cy = map(float, lines["cameras.txt"][0][4:8])
        points = {row[0]: tuple(map(float, row[1:4])) for row in lines["points3D.txt"]}
        squares = []
        for pose, seen in zip(lines["images.txt"][::2], lines["images.txt"][1::2]):
            w, x, y, z, *shift = map(float, pose[1:8])
            rows = ((1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
                    (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
                    (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)))
            for u, v, point in zip(seen[::3], seen[1::3], seen[2::3]):
                if point == "-1":
                    continue
                px, py, pz = (sum(a * b for a, b in zip(row, points[point])) + t for row, t in zip(rows, shift))
                squares += [(fx * px / pz + cx - float(u)) ** 2, (fy * py / pz + cy - float(v)) ** 2]
        return (sum(squares) / len(squares) / 2) ** 0.5

    def test_colmap_images_have_the_names_of_their_files(self):
        lines = (self.export("colmap", "model") / "images.txt").read_text().splitlines()
        names = [line.split()[9] for line in lines if line[0] != "#"][::2]
        self.assertEqual(len(names), info(self.map)["maps"][0]["keyframes"])
        for name in names:
            self.assertTrue((SCENE / "mav0/cam0/data" / name).is_file(), name)

    def test_several_maps(self):
        file = self.two_scenes() / "map.deepuav"
        maps = info(file)["maps"]
        self.assertEqual(len(maps), 2)
        for form, name, part in (("ply", "points.ply", "points-map-{}.ply"), ("tum", "poses.txt", "poses-map-{}.txt"),
                                 ("colmap", "model", "model-map-{}"), ("las", "a.b/points", "a.b/points-map-{}")):
            with self.subTest(form):
                (self.folder / name).parent.mkdir(exist_ok=True)
                self.export(form, name, file=file)
                self.assertFalse((self.folder / name).exists())
                for index in range(2):
                    self.assertTrue((self.folder / part.format(index)).exists())
        for index, one in enumerate(maps):
            chosen = self.export("ply", f"only{index}.ply", "--map", str(index), file=file)
            self.assertEqual(chosen.read_bytes(), (self.folder / f"points-map-{index}.ply").read_bytes())
            self.assertEqual(len(self.ply_points(chosen)), one["landmarks"])
        self.expect_failure(("map", "export", file, "--format", "ply", "--out", self.folder / "x", "--map", "2"),
                            "map.deepuav", "no map 2")

    def two_scenes(self):
        """A run whose camera is somewhere else from one image to the next."""
        dataset, out = self.folder / "scenes", self.folder / "scenes-out"
        layered_scene.euroc(dataset, OLD_FRAMES)
        layered_scene.euroc(self.folder / "other", OLD_FRAMES, seed=2)
        images = dataset / "mav0/cam0/data"
        with open(dataset / "mav0/cam0/data.csv", "a", encoding="utf-8") as frames:
            for file in sorted((self.folder / "other/mav0/cam0/data").iterdir()):
                later = f"{int(file.stem) + 10**10}"
                shutil.copy(file, images / f"{later}.png")
                frames.write(f"{later},{later}.png\n")
        call(*run_arguments(dataset, out, "--set", "tracking.max_lost_frames=2"))
        return out

    def test_nothing_can_be_written(self):
        for form in ("ply", "las", "tum"):
            self.expect_failure(("map", "export", self.map, "--format", form, "--out", self.folder / "absent/file"),
                                "absent/file")
        (self.folder / "file").write_text("")
        self.expect_failure(("map", "export", self.map, "--format", "colmap", "--out", self.folder / "file"), "file")

    def test_merge_says_that_networks_differ(self):
        other = self.folder / "other"
        int8 = MODEL.with_name("superpoint_small_int8.onnx")
        call(*run_arguments(SCENE, other, "--end", str(OLD_FRAMES), "--set", f"features.model={int8}"))
        result = call("map", "merge", self.map, other / "map.deepuav", "--out", self.folder / "absent/file")
        self.assertIn("places may not be recognised", result.stderr)
        self.assertIn(int8.name, result.stderr)

    def test_does_not_overwrite_its_input(self):
        copy = self.folder / "map.deepuav"
        shutil.copy(self.map, copy)
        self.expect_failure(("map", "export", copy, "--format", "ply", "--out", copy), "map.deepuav", "is the input")
        self.expect_failure(("map", "merge", self.map, copy, "--out", copy), "map.deepuav", "is the input")
        self.assertEqual(copy.read_bytes(), self.map.read_bytes())

    def test_merge_finds_at_once_that_nothing_can_be_written(self):
        self.expect_failure(("map", "merge", self.map, self.map, "--out", self.folder / "absent/file", "--log-level",
                             "off"), "absent/file")

    def test_wrong_use(self):
        export = ("map", "export", self.map)
        for arguments, part in ((("map",), "subcommand"), (("map", "info"), "FILE"), (export, "--format"),
                                ((*export, "--format", "ply"), "--out"), (("map", "fly"), "'fly'"),
                                ((*export, "--format", "obj", "--out", "x"), "obj"),
                                ((*export, "--format", "ply", "--out", "x", "--map", "-1"), "0 to 2147483647"),
                                (("map", "merge", self.map, self.map, "--out", "x", "--set", "places.vocabulary="),
                                 "places.vocabulary is empty")):
            with self.subTest(arguments=arguments):
                self.expect_failure(arguments, part, status=WRONG_USE)

    def test_help(self):
        for arguments in (("map",), ("map", "info"), ("map", "export")):
            self.assertIn("Usage", succeed(*arguments, "--help"))
        self.assertIn("Example", succeed("map", "export", "--help"))


class Killed(MapTest):
    """Whenever a run is killed, its map is the whole old one or the whole new one."""

    def test_at_random_moments(self):
        generator = random.Random(3)
        began = time.monotonic()
        succeed(*run_arguments(SCENE, self.folder / "timed"))
        run_s = time.monotonic() - began
        killed, left_old, while_writing = 0, 0, 0
        for attempt in range(4 * KILLS):
            if attempt >= KILLS and while_writing > 0:  # a busy machine hits the moment less often
                break
            out = self.folder / f"out{attempt}"
            shutil.copytree(OLD, out)
            process = subprocess.Popen(command(*run_arguments(SCENE, out)), stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL, env=ENVIRONMENT)
            if attempt % 3 == 0:
                time.sleep(generator.uniform(0, run_s))
            else:  # the last moments are the ones that count
                self.wait_for_writing(process, out)
                time.sleep(generator.uniform(0, 0.04))
            process.kill()
            killed += process.wait() < 0
            left_old += self.check_whole(out)
            while_writing += any(name.endswith(".tmp") for name in os.listdir(out))
        self.assertGreater(killed, KILLS // 3, "the runs end before they are killed")
        self.assertGreater(left_old, 0)
        self.assertGreater(while_writing, 0)

        out = self.folder / "out0"
        succeed(*run_arguments(SCENE, out))
        self.assertFalse(self.check_whole(out), "the next run replaces the map")

    def wait_for_writing(self, process, out):
        probe = f".deepuav-{process.pid}-0.tmp"  # of the check that files can be made
        while process.poll() is None:
            if any(name.endswith(".tmp") and name != probe for name in os.listdir(out)):
                return
            time.sleep(0.0005)

    def check_whole(self, out):
        """Whether the map is still the old one."""
        content = (out / "map.deepuav").read_bytes()
        old, new = (OLD / "map.deepuav").read_bytes(), (NEW / "map.deepuav").read_bytes()
        self.assertNotEqual(old, new)
        self.assertIn(content, (old, new), out)
        self.assertGreater(info(out / "map.deepuav")["maps"][0]["keyframes"], 3)
        return content == old


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    DEEPUAV = str(Path(sys.argv.pop(1)).resolve())
    program = unittest.main(exit=False)
    skipped = program.result.skipped
    if skipped:
        print(f"skipped: {skipped[0][1]}")
    sys.exit(1 if not program.result.wasSuccessful() else SKIPPED if skipped else 0)
