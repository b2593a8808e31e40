#!/usr/bin/env python3
"""A sequence whose lens is no more than guessed, or told wrongly: `deepuav run` mends it by its images, and begins anew with
it.

  untold_lens_test.py DEEPUAV
"""
import json
import os
import re
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

from program_under_test import TIMEOUT_S, UnderWay, command, main

FOCAL_PX, EXCESS = 460, 1.25
WIDTH, HEIGHT = 752, 480


class UntoldLens(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="deepuav-untold-lens-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        os.environ["XDG_CACHE_HOME"] = str(cls.folder / "cache")
        cls.flight = cls.folder / "flight"
        lens = {"width": WIDTH, "height": HEIGHT, "fx": FOCAL_PX, "fy": FOCAL_PX, "cx": 381, "cy": 236,
                "distortion": "-0.28 0.08 0 0", "rate_hz": 10}
        options = [part for name, value in lens.items() for part in ("--set", f"camera.{name}={value}")]
        subprocess.run(command("simulate", "--flight", "orbit", "--seed", "5", "--out", cls.flight, "--frames", "60", *options),
                       capture_output=True, timeout=TIMEOUT_S, check=True)
        cls.guess = cls.folder / "guess.yaml"
        cls.guess.write_text(f"model: auto\nwidth: {WIDTH}\nheight: {HEIGHT}\nfx: {EXCESS * FOCAL_PX}\n"
                             f"fy: {EXCESS * FOCAL_PX}\ncx: {(WIDTH - 1) / 2}\ncy: {(HEIGHT - 1) / 2}\n")

    def arguments(self, camera, name, *more):
        return ("run", self.flight, "--out", self.folder / name, "--use", "camera", "--camera", camera,
                "--set", "mapping.lens.min_keyframes=5", *more)

    def run_with(self, camera, name, *more):
        """The run's error in metres and what it said."""
        out = self.folder / name
        result = subprocess.run(command(*self.arguments(camera, name, *more)), capture_output=True, text=True,
                                timeout=TIMEOUT_S, check=True)
        subprocess.run(command("eval", self.flight, out / "trajectory.txt", "--json", out / "eval.json"),
                       capture_output=True, timeout=TIMEOUT_S, check=True)
        return json.loads((out / "eval.json").read_text())["ate_m"]["rmse"], result.stderr

    def ended_with(self, name, pattern):
        """The number that the calibration written by a run has there."""
        return float(re.search(pattern, (self.folder / name / "camera.yaml").read_text(), re.MULTILINE).group(1))

    def run_from_guess(self, name, *more):
        """The focal length that the run ended with, its error in metres and what it said."""
        error_m, said = self.run_with(self.guess, name, *more)
        return self.ended_with(name, r"^fx: (\S+)"), error_m, said

    def test_is_found_in_a_sample_and_mended_by_all_images(self):
        focal_px, error_m, said = self.run_from_guess("sample")
        self.assertIn("focal length found from 30 images", said)
        self.assertAlmostEqual(focal_px, FOCAL_PX, delta=0.005 * FOCAL_PX)
        self.assertLess(error_m, 0.03)

    def test_is_mended_where_no_sample_tells_it(self):
        no_sample = ("--set", "survey.min_map_views=1000")
        focal_px, error_m, said = self.run_from_guess("mended", *no_sample)
        self.assertIn("the images do not tell the lens", said)
        self.assertIn("once more from the first image on", said)
        self.assertAlmostEqual(focal_px, FOCAL_PX, delta=0.01 * FOCAL_PX)
        self.assertLess(error_m, 0.05)
        focal_px, error_of_guess_m, said = self.run_from_guess("guessed", *no_sample, "--set", "mapping.lens.enabled=false")
        self.assertNotIn("once more", said)
        self.assertAlmostEqual(focal_px, EXCESS * FOCAL_PX, delta=1)
        self.assertGreater(error_of_guess_m, 2 * error_m)

    def told(self, name, focal_px, distortion="-0.28, 0.08, 0, 0"):
        """A calibration of the flight's camera."""
        path = self.folder / f"{name}.yaml"
        path.write_text(f"model: radial_tangential\nwidth: {WIDTH}\nheight: {HEIGHT}\nfx: {focal_px}\nfy: {focal_px}\n"
                        f"cx: 381\ncy: 236\ndistortion: [{distortion}]\n")
        return path

    def doubt_of(self, name):
        return json.loads((self.folder / name / "summary.json").read_text())["doubtful_focal_length"]

    def test_a_told_focal_length_that_is_right_is_kept(self):
        _, said = self.run_with(self.told("right", FOCAL_PX), "right")
        self.assertNotIn("once more", said)
        self.assertNotIn("contradict", said)
        self.assertIsNone(self.doubt_of("right"))
        self.assertAlmostEqual(self.ended_with("right", r"^fx: (\S+)"), FOCAL_PX, delta=0.01)

    def test_a_told_focal_length_that_is_wrong_is_found(self):
        for name, factor, distortion in [("long", 1.1, "-0.28, 0.08, 0, 0"), ("twice", 2, "-0.28, 0.08, 0, 0"),
                                         ("short", 0.9, "-0.28, 0.08, 0, 0, 0.001")]:
            error_m, said = self.run_with(self.told(name, factor * FOCAL_PX, distortion), name)
            self.assertIn("contradict the focal length: a " + ("shorter" if factor > 1 else "longer"), said)
            self.assertIn("times the focal length that was told: that is followed", said)
            self.assertIn("once more from the first image on", said)
            focal_px = self.ended_with(name, r"^fx: (\S+)")
            self.assertAlmostEqual(focal_px, FOCAL_PX, delta=0.01 * FOCAL_PX, msg=name)
            self.assertLess(error_m, 0.05, name)
            doubt = self.doubt_of(name)
            self.assertAlmostEqual(doubt["told_px"], factor * FOCAL_PX, delta=0.01)
            self.assertAlmostEqual(doubt["fits_better_px"], focal_px, delta=0.01)
            self.assertTrue(0 < doubt["sigma_px"] < 0.01 * FOCAL_PX, doubt)

    def test_a_told_focal_length_that_is_wrong_is_kept_where_no_sample_confirms_it(self):
        told_px = 1.1 * FOCAL_PX
        told = self.told("unconfirmed", told_px)
        for name, *options in [("no_sample", "--set", "survey.min_map_views=1000"), ("live", "--schedule", "live")]:
            _, said = self.run_with(told, name, *options)
            self.assertIn("contradict the focal length: a shorter", said)
            self.assertNotIn("once more", said, name)
            self.assertEqual("the images do not tell the lens" in said, name == "no_sample")
            self.assertEqual("`model: auto`" in said, name == "live")
            self.assertAlmostEqual(self.ended_with(name, r"^fx: (\S+)"), told_px, delta=0.01, msg=name)
            self.assertAlmostEqual(self.ended_with(name, r"^distortion: \[(\S+),"), -0.28, delta=1e-6)
            doubt = self.doubt_of(name)
            self.assertAlmostEqual(doubt["told_px"], told_px, delta=0.01)
            self.assertLess(abs(doubt["fits_better_px"] - FOCAL_PX), 0.8 * abs(told_px - FOCAL_PX), name)
        first = (self.folder / "no_sample" / "trajectory.txt").read_bytes()
        for name, moment in (("in_sample", "contradict the focal length"), ("in_second", "once more from the first image on")):
            run = UnderWay(self.folder / f"{name}.log", *self.arguments(told, name), stdout=subprocess.DEVNULL)
            run.wait_for(moment)
            run.process.send_signal(signal.SIGINT)
            self.assertEqual(run.process.wait(TIMEOUT_S), 130)
            self.assertTrue(json.loads((self.folder / name / "summary.json").read_text())["stopped_early"], name)
            self.assertEqual((self.folder / name / "trajectory.txt").read_bytes(), first, name)

    def test_photographs_at_once_find_it_too(self):
        told_px = 1.1 * FOCAL_PX
        told = self.told("photographs", told_px)
        out = self.folder / "photographs"
        result = subprocess.run(command("run", self.flight / "mav0/cam0/data", "--out", out, "--camera", told, "--stride", "2"),
                                capture_output=True, text=True, timeout=TIMEOUT_S, check=True)
        self.assertIn("contradict the focal length: a shorter", result.stderr)
        self.assertIn("once more, as if their lens were not known", result.stderr)
        focal_px = self.ended_with("photographs", r"^fx: (\S+)")
        self.assertAlmostEqual(focal_px, FOCAL_PX, delta=0.01 * FOCAL_PX)
        self.assertAlmostEqual(self.doubt_of("photographs")["told_px"], told_px, delta=0.01)
        self.assertAlmostEqual(self.doubt_of("photographs")["fits_better_px"], focal_px, delta=0.01)
        self.assertEqual(json.loads((out / "summary.json").read_text())["frames"]["located"], 30)

    def test_a_told_distortion_that_is_wrong_is_corrected(self):
        told = self.told("bent", FOCAL_PX, "-0.25, 0.08, 0, 0")
        kept_m, said_of_kept = self.run_with(told, "kept", "--set", "mapping.lens.enabled=false")
        once_m, said_of_once = self.run_with(told, "once", "--set", "mapping.lens.begin_anew_px=1000")
        anew_m, said_of_anew = self.run_with(told, "anew")
        self.assertLess(once_m, 0.6 * kept_m)
        self.assertLess(anew_m, 0.6 * kept_m)
        self.assertNotIn("once more", said_of_kept + said_of_once)
        _, *anew = said_of_anew.split("once more from the first image on")
        self.assertEqual(len(anew), 1, "the second map is of the right lens")
        for shift_px in re.findall(r"corrected by (\S+) px", anew[0]):
            self.assertLess(float(shift_px), 0.5, "the rest, not all of it once more")
        self.assertAlmostEqual(self.ended_with("anew", r"^distortion: \[(\S+),"), -0.28, delta=0.015,
                               msg="half as wrong, at most")
        _, live = self.run_with(told, "live", "--schedule", "live")
        self.assertNotIn("once more", live)


if __name__ == "__main__":
    main(__doc__)
