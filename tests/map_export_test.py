#!/usr/bin/env python3
"""What other programs make of the exports of saved maps.

  map_export_test.py DEEPUAV

Exits with 77, which ctest shows as skipped, where COLMAP or laspy are absent and the rest passed.
"""
import json
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import time
import unittest
import zlib
from pathlib import Path

import layered_scene
from map_fixtures import (ENVIRONMENT, MODEL, MapTest, NEW, OLD_FRAMES, ROOT, SCENE, call, info, run_arguments, setUpModule,
                          succeed)
from program_under_test import WRONG_USE, command, main


def python_with(module):
    """An interpreter that has the module: the one of scripts/test.sh or this one; None without."""
    for python in (ROOT / ".venv/bin/python", Path(sys.executable)):
        if python.exists() and subprocess.run([python, "-c", f"import {module}"], capture_output=True,
                                              check=False).returncode == 0:
            return python
    return None


def reddened(png):
    """A grey PNG of layered_scene with half of its light in green and none in blue."""
    width, height = struct.unpack(">II", png[16:24])
    start = png.index(b"IDAT")
    rows = zlib.decompress(png[start + 4:start + 4 + struct.unpack(">I", png[start - 4:start])[0]])
    pixels = b"".join(b"\0" + b"".join(bytes((grey, grey // 2, 0)) for grey in rows[y * (width + 1) + 1:(y + 1) * (width + 1)])
                      for y in range(height))

    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return png[:8] + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(pixels)) + chunk(b"IEND", b"")


class Export(MapTest):
    def test_points_and_poses_are_those_of_the_run(self):
        self.assertEqual(self.ply_points(self.export("ply", "points.ply")), self.ply_points(NEW / "points.ply"))
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
        self.assertGreater(len(set(red)), 20)
        self.assertEqual({level % 257 for level in red}, {0})
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

    def test_a_signal_leaves_no_part_of_an_orthophoto(self):
        arguments = ("map", "export", self.map, "--format", "orthophoto", "--out", self.folder / "ortho.tif",
                     "--resolution", "0.001")
        with subprocess.Popen(command(*arguments), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              env=ENVIRONMENT) as process:
            while not list(self.folder.glob("*.tmp")) and process.poll() is None:
                time.sleep(0.001)
            self.assertIsNone(process.poll(), "ended before it was met at work")
            process.send_signal(signal.SIGTERM)
            self.assertIn(process.wait(timeout=60), (143, -signal.SIGTERM))
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_points_without_images_are_grey(self):
        alone = self.folder / "alone.deepuav"
        shutil.copy(self.map, alone)
        arguments = ("map", "export", alone, "--format", "ply", "--out", self.folder / "points.ply")
        self.assertIn("points are grey: ", succeed(*arguments))
        self.assertEqual((self.folder / "points.ply").read_bytes(), (NEW / "points.ply").read_bytes())
        self.assertNotIn("points are grey", succeed(*arguments, "--images", SCENE))
        self.expect_failure((*arguments, "--images", self.folder / "absent"), "absent")

    def test_points_have_the_colours_of_the_images(self):
        coloured = self.folder / "coloured"
        shutil.copytree(SCENE, coloured)
        for file in coloured.rglob("*.png"):
            file.write_bytes(reddened(file.read_bytes()))
        out = self.folder / "points.ply"
        succeed("map", "export", self.map, "--format", "ply", "--out", out, "--images", coloured)
        content = out.read_bytes()
        points = list(struct.iter_unpack("<fffBBB", content[content.index(b"end_header\n") + len(b"end_header\n"):]))
        self.assertGreater(len(points), 50)
        for *_, red, green, blue in points:
            self.assertEqual((green, blue), (red // 2, 0))
        self.assertGreater(len({point[3] for point in points}), 20)

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

    def test_merge_counts_what_it_joined(self):
        out = self.folder / "all.deepuav"
        for files, joined in ((1, "1 map joined to another, 0 loops closed"), (2, "2 maps joined to another, 0 loops closed")):
            lines = succeed("map", "merge", *[self.map] * (1 + files), "--out", out, "--log-level", "warn").splitlines()
            self.assertEqual(lines[0], joined)
            self.assertEqual(len(lines), 2)
            self.assertEqual(len(info(out)["maps"]), 1)

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


if __name__ == "__main__":
    main(__doc__)
