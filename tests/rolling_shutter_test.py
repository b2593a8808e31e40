#!/usr/bin/env python3
"""A camera that reads its images row by row and says so nowhere: `deepuav run` begins anew with what it found.

  rolling_shutter_test.py DEEPUAV
"""
import json
import os
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

import layered_scene
from program_under_test import TIMEOUT_S, UnderWay, command, main

FRAMES, READOUT_S = 40, 0.04


class RollingShutter(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="deepuav-rolling-shutter-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        os.environ["XDG_CACHE_HOME"] = str(cls.folder / "cache")
        cls.scene = layered_scene.euroc(cls.folder / "scene", FRAMES, path=layered_scene.weaving, readout_s=READOUT_S)

    def arguments(self, out, share):
        return ("run", self.scene, "--out", out, "--set", "mapping.readout.min_keyframes=5", "--set",
                f"mapping.readout.begin_anew_share={share}")

    def summary(self, out):
        return json.loads((out / "summary.json").read_text())

    def check_found(self, out):
        """The readout, and what is written of it."""
        summary = self.summary(out)
        found_s = 1e-3 * summary["found_readout"]["ms"]
        self.assertAlmostEqual(found_s, READOUT_S, delta=0.1 * READOUT_S)
        self.assertIn(f"readout_ms: {1e3 * found_s:.6g}", (out / "camera.yaml").read_text())
        self.assertEqual(summary["frames"]["located"], FRAMES)
        self.assertEqual([frame.split(",")[0] for frame in (out / "frames.csv").read_text().splitlines()[1:]],
                         [str(frame) for frame in range(FRAMES)])

    def test_begins_anew(self):
        once, again = self.folder / "once", self.folder / "again"
        said = {}
        for out, share in ((once, 1), (again, 0)):
            result = subprocess.run(command(*self.arguments(out, share)), capture_output=True, text=True,
                                    timeout=TIMEOUT_S, check=True)
            said[out] = result.stderr
            self.check_found(out)
        self.assertNotIn("once more", said[once])
        self.assertIn("once more from the first image on", said[again])
        self.assertEqual(said[again].count("map 0 starts"), 2)
        self.assertNotEqual((once / "trajectory.txt").read_bytes(), (again / "trajectory.txt").read_bytes())

    def test_nothing_is_lost_of_the_first_time(self):
        once, stopped = self.folder / "whole", self.folder / "stopped"
        subprocess.run(command(*self.arguments(once, 1)), capture_output=True, timeout=TIMEOUT_S, check=True)
        run = UnderWay(self.folder / "log", *self.arguments(stopped, 0), stdout=subprocess.DEVNULL)
        run.wait_for(r"once more from the first image on")
        run.process.send_signal(signal.SIGINT)
        self.assertEqual(run.process.wait(TIMEOUT_S), 130)
        self.check_found(stopped)
        self.assertTrue(self.summary(stopped)["stopped_early"])
        self.assertEqual((once / "trajectory.txt").read_bytes(), (stopped / "trajectory.txt").read_bytes())

    def test_images_tell_turns_that_their_path_does_not(self):
        """A camera that shakes faster than its images come, with a readout that is told, and one that is not."""
        flight = self.folder / "flight"
        subprocess.run(command("simulate", "--flight", "jitter", "--seed", "5", "--out", flight, "--frames", "60",
                               "--set", "camera.rate_hz=10"), capture_output=True, timeout=TIMEOUT_S, check=True)
        error_m, said = {}, {}
        for rounds in (0, 3):
            said[rounds], error_m[rounds] = self.run_shaken(flight, rounds)
        self.assertIn("shakes faster than its images come", said[0])
        self.assertNotIn("once more", said[0])
        self.assertNotIn("shakes faster", said[3])
        self.assertIn("once more from the first image on", said[3])
        self.assertLess(error_m[3], 0.2 * error_m[0])

        sensor = flight / "mav0/cam0/sensor.yaml"
        told = sensor.read_text()
        sensor.write_text("".join(line for line in told.splitlines(True) if "readout" not in line))
        said, error = self.run_shaken(flight, 3)
        self.assertIn("images turned while they were read", said)
        self.assertIn("once more from the first image on", said)
        self.assertAlmostEqual(self.summary(self.folder / "turns_3")["found_readout"]["ms"], 15, delta=4,
                               msg="six seconds tell it better than what was assumed, 20; half a minute to half a millisecond")
        self.assertLess(error, 0.3 * error_m[0])

    def run_shaken(self, flight, rounds):
        """What a run said, and its error in metres."""
        out = self.folder / f"turns_{rounds}"
        result = subprocess.run(command("run", flight, "--use", "camera", "--out", out, "--set", f"image_turns.rounds={rounds}"),
                                capture_output=True, text=True, timeout=TIMEOUT_S, check=True)
        self.assertEqual(self.summary(out)["frames"]["located"], 60)
        subprocess.run(command("eval", flight, out / "trajectory.txt", "--align", "sim3", "--json", out / "eval.json"),
                       capture_output=True, timeout=TIMEOUT_S, check=True)
        return result.stderr, json.loads((out / "eval.json").read_text())["ate_m"]["rmse"]


if __name__ == "__main__":
    main(__doc__)
