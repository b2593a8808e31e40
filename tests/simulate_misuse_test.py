#!/usr/bin/env python3
"""What `deepuav simulate` refuses by name, and how soon.

  simulate_misuse_test.py DEEPUAV
"""
import time

from program_under_test import FAILURE, WRONG_USE, main
from simulate_fixtures import SimulateTest, call


class SimulateMisuse(SimulateTest):
    def test_wrong_use(self):
        out = self.folder / "wrong"
        for arguments, parts in (
                ([], ["--flight"]), (["--flight", "orbit"], ["--out"]),
                (["--flight", "orbitt", "--out", out], ["orbitt", "'orbit'"]),
                (["--flight", self.flight, "--out", out, "--set", "course.hight_m=3"], ["'course.height_m'"]),
                (["--flight", self.flight, "--out", out, "--set", "course.kind=loop"], ["course.kind is 'loop'"]),
                (["--flight", self.flight, "--out", out, "--set", "camera.fx=-1"], ["fx"]),
                (["--flight", self.flight, "--out", out, "--set", "camera.model=equidistant", "--set",
                  "camera.distortion=1 2"], ["distortion"]),
                (["--flight", self.flight, "--out", out, "--set", "output.image_format=bmp"], ["bmp"]),
                (["--flight", self.flight, "--out", out, "--scene", "moon"], ["moon"]),
                (["--flight", self.flight, "--out", out, "--seed", "-1"], ["--seed", "0 to 2147483647"]),
                (["--flight", self.flight, "--out", out, "--frames", "0"], ["--frames", "-1 or", "at least 1"]),
                (["--flight", self.flight, "--out", out, "--orthophoto", "1e300"], ["--orthophoto", "at most 1000"]),
                (["--flight", self.flight, "--out", ""], ["--out", "empty"])):
            with self.subTest(arguments=arguments):
                self.expect_failure(call("simulate", *arguments), WRONG_USE, *parts)
        self.assertFalse(out.exists())
        self.expect_failure(self.simulate(out, "--set", "course.length_m=900"), FAILURE, "the course comes to")

    def test_absurd_options_are_refused_by_name(self):
        """What crashed or hung: segmentation faults, Embree's assertions, vectors beyond any memory, days of flight."""
        absurd = ["course.laps=1e8", "course.speed_m_s=1e6", "course.speed_m_s=1000", "course.speed_m_s=0.01",
                  "sensor.read_noise_electrons=1e20", "sensor.full_well_electrons=1e308", "imu.rate_hz=1e9",
                  "camera.width=2000000000", "flight.duration_s=1e9"]
        for option in ("weather.sun", "weather.sky", "mount.x_m", "wind.jitter_position_m", "gnss.lever_x_m",
                       "scene.relief_m", "course.center_x_m"):
            absurd += [f"{option}=1e40", f"{option}=1e308", f"{option}=-1e308"]
        out = self.folder / "absurd"
        for assignment in absurd:
            with self.subTest(assignment):
                name = assignment.split("=")[0]
                result = call("simulate", "--flight", "orbit", "--frames", 1, "--out", out, "--set", assignment)
                self.expect_failure(result, WRONG_USE, f"option {name} is ", "expected")
        self.assertFalse(out.exists())

    def test_a_course_that_takes_hours_is_refused_at_once(self):
        for assignment, parts in (("course.laps=1000", ["km long", "course.laps"]),
                                  ("course.laps=20", ["s to fly", "course.laps"]),
                                  ("course.speed_m_s=0.1", ["s to fly", "course.speed_m_s"])):
            with self.subTest(assignment):
                began = time.monotonic()
                more = ["--set", "course.length_m=600", "--set", "course.width_m=300", "--set", "scene.extent_m=1200"]
                result = call("simulate", "--flight", self.flight, "--frames", 1, "--out", self.folder / "long",
                              *more, "--set", assignment)
                self.expect_failure(result, FAILURE, *parts)
                self.assertLess(time.monotonic() - began, 60)

    def test_a_hundred_laps_of_a_shipped_flight_are_refused(self):
        result = call("simulate", "--flight", "orbit", "--frames", 1, "--out", self.folder / "hundred",
                      "--set", "course.laps=100")
        self.expect_failure(result, FAILURE, "s to fly", "course.laps")

    def test_a_long_course_is_planned_soon(self):
        out = self.folder / "ten-laps"
        began = time.monotonic()
        self.expect_success(call("simulate", "--flight", "orbit", "--frames", 1, "--out", out, "--set",
                                 "course.laps=20"))
        self.assertLess(time.monotonic() - began, 100)


if __name__ == "__main__":
    main(__doc__)
