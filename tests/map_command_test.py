#!/usr/bin/env python3
"""Saved maps as their users meet them: runs that go on with one, `deepuav map info`, and runs killed while a good map
lies in their output folder.

  map_command_test.py DEEPUAV
"""
import hashlib
import json
import os
import random
import shutil
import struct
import subprocess
import time
from pathlib import Path

import layered_scene
from map_fixtures import ENVIRONMENT, MODEL, MapTest, NEW, OLD, ROOT, SCENE, call, info, run_arguments, setUpModule, succeed
from program_under_test import FAILURE, command, main


KILLS = 15
HEADER_BYTES = 12


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
        for other, part in ((version + 1, "of a newer program"), (1, "format version"), (2**32 - 1, "newer")):
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
    main(__doc__)
