#!/usr/bin/env python3
"""The program as its users meet it: exit statuses and messages about wrong use and wrong input.

  command_test.py DEEPUAV
"""
import json
import os
import subprocess

import command_test_data as data
from command_fixtures import CommandTest, ENVIRONMENT, SCRATCH, call
from program_under_test import FAILURE, WRONG_USE, command, main


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
                                 ([*run, "--use", "camera,attitude"], "gnss"),
                                 ([*run, "--log-level", "loud"], "loud"),
                                 (["eval", SCRATCH, __file__, "--end", "0"], "above 0"),
                                 (["eval", SCRATCH, __file__, "--rpe-delta", "0"], "more than 0, at most"),
                                 (["eval", SCRATCH, __file__, "--start", "-1"], "0 to 1000000000"),
                                 (["eval", SCRATCH, __file__, "--align", "so3"], "so3")):
            with self.subTest(arguments=arguments):
                self.expect_failure(call(*arguments), named, status=WRONG_USE)

    def test_numbers_beyond_their_bounds_are_told_by_their_argument(self):
        compared = ["--max-difference", "--time-offset", "--search-offset", "--max-gap", "--start", "--rpe-delta"]
        export = ["map", "export", "x.deepuav", "--format", "dsm", "--out", "x.tif"]
        for arguments, options in ((["eval", "a", "b"], compared), (["report", "out"], [*compared, "--pairs", "--points"]),
                                   (export, ["--resolution"])):
            for option in options:
                with self.subTest(arguments=arguments, option=option):
                    self.expect_failure(call(*arguments, option, "1e300"), f"{option}: '1e300': expected ",
                                        status=WRONG_USE)
        self.expect_failure(call("eval", "a", "b", "--start", "5", "--end", "3"), "--end is 3: expected more than --start, 5",
                            status=WRONG_USE)

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

    def test_lists_the_options_of_a_run(self):
        table = {option["name"]: option for option in json.loads(call("options", "--json").stdout)}
        for option in table.values():
            self.assertTrue(option["meaning"], option["name"])
        self.assertEqual(table["tracking.max_lost_frames"]["bounds"].split()[1], "to")
        self.assertEqual(table["features.keypoints"]["value"], "1000")
        text = call("options", "features", "--set", "features.keypoints=77").stdout
        self.assertIn("\nfeatures.keypoints=77 (1 to 20000)\n    ", text)
        self.assertNotIn("mapping.local_bundle", text)
        self.expect_failure(call("options", "flux capacitor"), "no option speaks of flux capacitor")
        self.expect_failure(call("options", "--set", "features.keypoints=0"), "features.keypoints is 0", status=WRONG_USE)

    def test_localising_without_places(self):
        self.expect_failure(call("run", "nowhere", "--out", self.out, "--map", "nowhere", "--localise-only",
                                 "--set", "places.vocabulary="), "system.localise_only", "places.vocabulary",
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

    def test_a_folder_of_several_datasets(self):
        heap = self.folder / "heap"
        for name in ("first", "second"):
            data.small_euroc(heap / name)
        self.expect_refused(heap, "heap: holds datasets in sub-folders: expected one of them (first, second)")

    def test_images_of_formats_that_are_not_read(self):
        phone = self.folder / "phone"
        phone.mkdir()
        for name in ("IMG_1.HEIC", "IMG_2.HEIC", "a.gif"):
            (phone / name).write_text("")
        self.expect_refused(phone, "1 .gif (a.gif), 2 .heic (IMG_1.HEIC, ...)", "converted to JPEG")

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
        run = ["run", dataset, "--out", self.out]
        for arguments in (["eval", pipe, good], ["eval", good, pipe], ["map", "info", pipe],
                          ["map", "export", pipe, "--format", "ply", "--out", self.folder / "points.ply"],
                          ["map", "merge", pipe, pipe, "--out", self.folder / "merged"], ["match", "--pairs", pipe],
                          [*run, "--model", pipe], [*run, "--set", f"features.model={pipe}"],
                          [*run, "--set", f"places.vocabulary={pipe}"], ["match", pipe, pipe],
                          ["run", dataset, "--out", self.out, "--camera", pipe, "--set", "features.model=x.onnx"],
                          ["run", film, "--out", self.out, "--set", "features.model=x.onnx"],
                          ["run", dataset, "--out", self.out, "--map", pipe, "--set", "features.model=x.onnx"]):
            with self.subTest(arguments=arguments):
                self.expect_failure(call(*arguments), "is a named pipe: expected a file")
        self.expect_failure(call("run", dataset, "--out", self.out, "--config", pipe), "is a named pipe",
                            status=WRONG_USE)

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
        for *arguments, option in (["run", dataset, "--out=-"], ["simulate", "--flight", "orbit", "--out=-"],
                                   ["map", "export", "x.deepuav", "--format", "ply", "--out=-"],
                                   ["map", "merge", "a.deepuav", "b.deepuav", "--out=-"],
                                   ["match", "a.png", "b.png", "--out=-"], ["match", "a.png", "b.png", "--draw=-"],
                                   ["report", "out", "--html=-"], ["report", "out", "--plots=-"]):
            with self.subTest(arguments=arguments):
                self.expect_failure(call(*arguments, option, cwd=self.folder), option.split("=")[0],
                                    "is '-': expected a path", status=WRONG_USE)
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


if __name__ == "__main__":
    main(__doc__)
