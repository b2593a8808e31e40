#!/usr/bin/env python3
"""Runs as their users meet them: output folders, damaged data, the terminal.

  run_command_test.py DEEPUAV

Exits with 77, which ctest shows as skipped, where there is no network or no sequence in $DEEPUAV_SHARED.
"""
import fcntl
import json
import os
import pty
import re
import resource
import struct
import subprocess
import termios
import time

import command_test_data as data
from command_fixtures import (ENVIRONMENT, MODEL, OUTPUT_FILES, REPRODUCIBLE_FILES, SEQUENCE, call, run_arguments,
                              summary_of)
from program_under_test import FAILURE, command, main
from run_fixtures import RunTest


class Run(RunTest):
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

    def test_options_of_a_run_are_those_that_were_asked_for(self):
        """What took their place here may be wrong for the next run."""
        self.assertRegex((self.short_out / "options.yaml").read_text(), r"\n  method: auto\b")
        self.assertEqual(summary_of(self.short_out)["options"]["matching.method"], "nearest")

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
        result = subprocess.run([os.fsencode(command()[0]), b"run", dataset, b"--out", os.fsencode(self.out), b"--config",
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
    main(__doc__)
