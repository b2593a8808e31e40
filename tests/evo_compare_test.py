#!/usr/bin/env python3
"""The figures of `deepuav eval` agree with evo's, the independent judge, on made-up trajectories.

  evo_compare_test.py DEEPUAV

Exits with 77, which ctest shows as skipped, where evo is not installed.
"""
import itertools
import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SKIPPED = 77
ENTERED = "DEEPUAV_EVO_PYTHON"

# evo keeps settings in the user's folder unless told otherwise.
scratch = tempfile.TemporaryDirectory()
os.environ.setdefault("EVO_HOME", scratch.name)
os.environ.setdefault("MPLCONFIGDIR", scratch.name)
try:
    import numpy as np
    from evo.core import metrics, sync
    from evo.core.units import Unit
    from evo.tools import file_interface
except ImportError as error:
    python = Path(__file__).resolve().parent.parent / ".venv/bin/python"
    if python.exists() and ENTERED not in os.environ:
        os.environ[ENTERED] = "1"
        os.execv(python, [str(python), *sys.argv])
    print(f"skipped: {error}; scripts/test.sh installs it")
    sys.exit(SKIPPED)

DEEPUAV = None
TOLERANCE = 1e-6
STATISTICS = ("rmse", "mean", "median", "std", "min", "max", "sse")


def multiply(a, b):
    """Products of quaternions w, x, y, z, row by row."""
    w, v, u, t = a[:, :1], a[:, 1:], b[:, :1], b[:, 1:]
    return np.hstack((w * u - np.sum(v * t, 1, keepdims=True), w * t + u * v + np.cross(v, t)))


def rotate(q, p):
    conjugate = q * [1, -1, -1, -1]
    return multiply(multiply(q, np.hstack((np.zeros((len(p), 1)), p))), conjugate)[:, 1:]


def exponential(vectors):
    angle = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.hstack((np.cos(angle / 2), np.sinc(angle / 2 / np.pi) * vectors / 2))


def flight(random, stamps):
    """A smooth path: positions and orientations at the stamps, seconds from its start."""
    phase, rate, size = random.uniform(0, 6, (3, 2)), random.uniform(0.1, 0.7, (3, 2)), [8, 3]
    angle = lambda k: stamps[:, None] * rate[:, k] + phase[:, k]
    positions = sum(size[k] * np.sin(angle(k)) for k in range(2)) * [1, 1, 0.3]
    return positions, exponential(0.8 * np.sin(angle(0)) * [0.3, 0.4, 1.2])


def write_tum(path, stamps, positions, rotations):
    rows = np.column_stack((positions, np.roll(rotations, -1, axis=1)))
    lines = (f"{t:.9f} " + " ".join(f"{x:.9f}" for x in row) for t, row in zip(stamps, rows))
    path.write_text("# timestamp tx ty tz qx qy qz qw\n" + "\n".join(lines) + "\n")


class Case:
    """A pair of files: the truth, and it again by another clock in another world, with noise."""

    def __init__(self, name, seed, *, noise=0.0, scale=1.0, rates=(20.0, 20.0), jitter=0.0, start=0.0,
                 kept=1.0, offset=0.0, duration=40.0):
        random = np.random.default_rng(seed)
        self.name, self.offset = name, offset
        self.truth = Path(scratch.name) / f"{name}_truth.txt"
        self.estimate = Path(scratch.name) / f"{name}_estimate.txt"
        stamps = np.arange(0, duration, 1 / rates[0])
        state = random.bit_generator.state
        write_tum(self.truth, start + stamps, *flight(random, stamps))

        stamps = np.arange(0, duration, 1 / rates[1])
        random.bit_generator.state = state
        positions, rotations = flight(random, stamps)
        turn = exponential(random.normal(0, 1.5, (1, 3))).repeat(len(stamps), 0)
        positions = rotate(turn, positions + noise * random.normal(0, 1, positions.shape)) / scale
        rotations = multiply(turn, multiply(rotations, exponential(noise * random.normal(0, 1, positions.shape))))
        seen = random.uniform(0, 1, len(stamps)) < kept
        clock = start + stamps - offset + random.uniform(-jitter, jitter, len(stamps))
        write_tum(self.estimate, clock[seen], positions[seen] + [3, -20, 7], rotations[seen])

    def deepuav(self, *options):
        command = [DEEPUAV, "eval", self.truth, self.estimate, "--time-offset", repr(self.offset), "--json", "-"]
        done = subprocess.run([*map(str, command), *options], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise AssertionError(f"{self.name} {options}: {done.stderr}")
        return json.loads(done.stdout)

    def evo(self, align, correct_scale):
        truth = file_interface.read_tum_trajectory_file(self.truth)
        estimate = file_interface.read_tum_trajectory_file(self.estimate)
        truth, estimate = sync.associate_trajectories(truth, estimate, max_diff=0.01, offset_2=self.offset)
        if align:
            estimate.align(truth, correct_scale=correct_scale)
        return truth, estimate


ALIGNMENTS = {"none": (False, False), "se3": (True, False), "sim3": (True, True)}
STEPS = [(1, "frames", False), (7, "frames", False), (7, "frames", True), (1.5, "m", False), (1.5, "m", True)]
RELATIONS = {
    "translation_m": metrics.PoseRelation.translation_part,
    "rotation_deg": metrics.PoseRelation.rotation_angle_deg,
}
UNITS = {"frames": Unit.frames, "m": Unit.meters}


class EvoCompareTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cases = [
            Case("exact", 1),
            Case("noisy", 2, noise=0.05),
            Case("scaled", 3, noise=0.02, scale=7.3),
            Case("missing_poses", 4, noise=0.05, scale=0.4, kept=0.6),
            Case("slow_estimate", 5, noise=0.03, rates=(200.0, 20.0), jitter=0.002, start=1403636580.0),
            Case("fast_estimate", 6, noise=0.03, rates=(7.0, 30.0)),
            Case("late_clock", 7, noise=0.1, scale=2.0, kept=0.9, jitter=0.004, offset=0.73, start=1500000000.0),
            # Several poses of the shorter trajectory find one pose of the longer one nearest. The jitter keeps differences
            # of time from being equal, where rounding would decide which of two is the nearest.
            Case("shared_poses", 8, noise=0.05, rates=(150.0, 200.0), kept=0.9, jitter=0.0007),
        ]

    def assert_statistics(self, ours, theirs, what):
        for name in STATISTICS:
            # A sum of squares grows with the number of poses.
            tolerance = TOLERANCE * (max(1, theirs[name]) if name == "sse" else 1)
            self.assertAlmostEqual(ours[name], float(theirs[name]), delta=tolerance, msg=f"{what}: {name}")

    def test_absolute_error(self):
        for case, (alignment, how) in itertools.product(self.cases, ALIGNMENTS.items()):
            with self.subTest(case=case.name, alignment=alignment):
                ours, poses = case.deepuav("--align", alignment), case.evo(*how)
                theirs = metrics.APE(metrics.PoseRelation.translation_part)
                theirs.process_data(poses)
                self.assertEqual(ours["associated_poses"], poses[0].num_poses)
                self.assert_statistics(ours["ate_m"], theirs.get_all_statistics(), "absolute error")
                np.testing.assert_allclose(ours["per_pose"]["error_m"], theirs.error, atol=TOLERANCE, rtol=0)

    def test_relative_error(self):
        for case, (alignment, how), step in itertools.product(self.cases, ALIGNMENTS.items(), STEPS):
            with self.subTest(case=case.name, alignment=alignment, step=step):
                delta, unit, all_pairs = step
                options = ["--rpe-delta", str(delta), "--rpe-unit", unit] + ["--rpe-all-pairs"] * all_pairs
                ours, poses = case.deepuav("--align", alignment, *options)["rpe"], case.evo(*how)
                for ours_name, relation in RELATIONS.items():
                    theirs = metrics.RPE(relation, delta, UNITS[unit], all_pairs=all_pairs)
                    theirs.process_data(poses)
                    self.assertEqual(ours["pairs"], len(theirs.error))
                    self.assert_statistics(ours[ours_name], theirs.get_all_statistics(), ours_name)

    def test_pairs_from_truth(self):
        case = self.cases[2]
        truth, estimate = case.evo(True, True)
        ours = case.deepuav("--rpe-delta", "2", "--rpe-unit", "m", "--rpe-pairs-from-truth")["rpe"]
        theirs = metrics.RPE(metrics.PoseRelation.translation_part, 2, Unit.meters, pairs_from_reference=True)
        theirs.process_data((truth, estimate))
        self.assert_statistics(ours["translation_m"], theirs.get_all_statistics(), "pairs from truth")

    def test_the_cases_are_what_they_say(self):
        figures = {case.name: case.deepuav() for case in self.cases}
        self.assertLess(figures["exact"]["ate_m"]["rmse"], 1e-6)
        self.assertGreater(figures["noisy"]["ate_m"]["rmse"], 0.05)
        self.assertAlmostEqual(figures["scaled"]["alignment"]["scale"], 7.3, delta=0.05)
        self.assertLess(figures["missing_poses"]["completeness"], 0.7)
        self.assertGreater(figures["shared_poses"]["shared_poses"], 0)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    DEEPUAV = Path(sys.argv.pop()).resolve()
    unittest.main()
