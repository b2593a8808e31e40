"""What the tests of `deepuav simulate` share: the program, a short flight, and what it may say."""
import subprocess
import tempfile
import unittest
from pathlib import Path

from program_under_test import command

FLIGHT = """
flight:
  scene: village
  duration_s: 2
course:
  kind: circuit
  length_m: 60
  width_m: 30
camera:
  model: pinhole
  width: 96
  height: 64
  fx: 70
  fy: 70
  cx: 47.5
  cy: 31.5
  rate_hz: 4
scene:
  extent_m: 400
  town_radius_m: 60
"""


def call(*arguments):
    return subprocess.run(command(*map(str, arguments)), capture_output=True, text=True, timeout=200, check=False)


def files_of(folder):
    return {str(file.relative_to(folder)): file.read_bytes() for file in sorted(folder.rglob("*")) if file.is_file()}


def rows_of(file):
    return [line.split(",") for line in file.read_text().splitlines() if not line.startswith("#")]


class SimulateTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory(prefix="deepuav-simulate-test-")
        cls.folder = Path(cls.scratch.name)
        cls.flight = cls.folder / "flight.yaml"
        cls.flight.write_text(FLIGHT)

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()

    @classmethod
    def simulate(cls, out, *more):
        return call("simulate", "--flight", cls.flight, "--out", out, *more)

    def expect_success(self, result):
        self.assertEqual(result.returncode, 0, result.stderr)
        for line in result.stderr.splitlines():  # how far it is, on a slow machine
            self.assertRegex(line, r"^info: \d+ of \d+ frames, ")

    def expect_failure(self, result, status, *parts):
        self.assertEqual(result.returncode, status, result.stderr)
        self.assertTrue(result.stderr.startswith("deepuav: "), result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        for part in parts:
            self.assertIn(part, result.stderr)


class DatasetTest(SimulateTest):
    """`dataset` is the whole flight."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.dataset = cls.folder / "dataset"
        cls.result = cls.simulate(cls.dataset)
