#!/usr/bin/env python3
"""`deepuav simulate` into a folder that was begun: it goes on after an interruption, and with the same flight only.

  simulate_resume_test.py DEEPUAV
"""
import resource
import signal
import subprocess
import sys
import time

from program_under_test import FAILURE, main
from simulate_fixtures import DatasetTest, files_of, rows_of

DEEPUAV = None


class SimulateResume(DatasetTest):
    def test_same_options_same_bytes_also_in_pieces(self):
        pieces = self.folder / "pieces"
        self.expect_success(self.simulate(pieces, "--frames", 3, "--threads", 1))
        self.assertEqual(len(rows_of(pieces / "mav0/cam0/data.csv")), 3)
        images = sorted((pieces / "mav0/cam0/data").iterdir())
        self.assertEqual(len(images), 3)
        kept = images[0].stat().st_mtime_ns
        images[1].unlink()
        self.expect_success(self.simulate(pieces))
        self.assertEqual(images[0].stat().st_mtime_ns, kept)
        self.assertEqual(files_of(pieces), files_of(self.dataset))

    def test_folder_of_another_flight_is_refused(self):
        before = files_of(self.dataset)
        self.expect_failure(self.simulate(self.dataset, "--set", "course.height_m=50"), FAILURE, "other options")
        self.assertEqual(files_of(self.dataset), before)

    def test_flight_written_before_an_option_came_goes_on(self):
        out = self.folder / "older"
        self.expect_success(self.simulate(out, "--frames", 1))
        options = out / "simulation.yaml"
        older = "".join(line for line in options.read_text().splitlines(keepends=True) if "lorry_fraction" not in line)
        options.write_text(older)
        self.expect_success(self.simulate(out, "--frames", 2))
        self.assertEqual(options.read_text(), older)
        self.expect_failure(self.simulate(out, "--set", "scene.lorry_fraction=0.5"), FAILURE, "other options")
        options.write_text(older + "future: 1\n")
        self.expect_failure(self.simulate(out), FAILURE, "other options")

    def test_signal_ends_it_and_it_goes_on(self):
        for sent, status in ((signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)):
            with self.subTest(sent.name):
                self.end_by(sent, status)

    def end_by(self, sent, status):
        out = self.folder / sent.name
        more = ["--set", "camera.rate_hz=400"]  # long enough to be met at work
        images_of_all = 801  # of two seconds
        process = subprocess.Popen([DEEPUAV, "simulate", "--flight", self.flight, "--out", out, *more],
                                   stdout=subprocess.DEVNULL)
        images = out / "mav0/cam0/data"
        deadline = time.monotonic() + 100
        while not (images.is_dir() and list(images.glob("*.jpg"))) and time.monotonic() < deadline:
            time.sleep(0.01)
        process.send_signal(sent)
        self.assertEqual(process.wait(timeout=60), status)
        listed = rows_of(out / "mav0/cam0/data.csv")
        self.assertTrue(0 < len(listed) < images_of_all, len(listed))
        self.assertEqual({row[1] for row in listed}, {image.name for image in images.iterdir()})
        self.expect_success(self.simulate(out, *more))
        self.assertEqual(len(rows_of(out / "mav0/cam0/data.csv")), images_of_all)

    def test_two_at_once_into_one_folder_are_refused(self):
        out = self.folder / "shared"
        more = ["--set", "camera.rate_hz=400"]  # long enough to be met at work
        first = subprocess.Popen([DEEPUAV, "simulate", "--flight", self.flight, "--out", out, *more],
                                 stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + 100
        while not list(out.glob("mav0/cam0/data/*")) and time.monotonic() < deadline:
            time.sleep(0.01)
        self.expect_failure(self.simulate(out, *more), FAILURE, "another deepuav is writing into it")
        first.terminate()
        self.assertEqual(first.wait(timeout=60), 143)
        self.expect_success(self.simulate(out, *more))

    def test_a_limit_of_file_sizes_is_a_failure_to_write(self):
        out = self.folder / "limited"
        limit = 2000  # bytes
        result = subprocess.run([DEEPUAV, "simulate", "--flight", self.flight, "--out", out, "--frames", "1"],
                                capture_output=True, text=True, timeout=200, check=False,
                                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        self.expect_failure(result, FAILURE, "File too large")
        self.assertEqual([file for file in out.rglob("*") if file.name.endswith(".tmp")], [])


if __name__ == "__main__":
    DEEPUAV = sys.argv[1]
    main(__doc__)
