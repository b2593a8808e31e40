#!/usr/bin/env python3
"""The scripts of bench/ without what need not be installed: all show their help, and those that lack something name it.

  bench_scripts_test.py
"""
import subprocess
import sys
import unittest
from pathlib import Path

BENCH = Path(__file__).resolve().parents[1] / "bench"
SCRIPTS = [file for file in sorted(BENCH.rglob("*.py")) if "__main__" in file.read_text()]


def call(script, *arguments):
    """With the standard library alone."""
    return subprocess.run([sys.executable, "-B", "-E", "-s", "-S", script, *arguments], capture_output=True, text=True,
                          timeout=60, check=False)


class BenchScripts(unittest.TestCase):
    def test_help_needs_nothing(self):
        self.assertGreater(len(SCRIPTS), 10)
        for script in SCRIPTS:
            with self.subTest(script.name):
                result = call(script, "--help")
                self.assertEqual((result.returncode, result.stderr), (0, ""))
                self.assertIn("usage:", result.stdout)

    def test_what_is_missing_is_told_in_one_line(self):
        for script, arguments in (("system/hard_cuts.py", ["--only"]), ("system/places.py", ["--only"]),
                                  ("live/soak.py", ["deepuav", "dataset", "camera.yaml"])):
            with self.subTest(script):
                result = call(BENCH / script, *arguments)
                self.assertEqual((result.returncode, result.stdout), (1, ""))
                self.assertRegex(result.stderr, rf"^{Path(script).name}: no module \w+: expected .*Pillow.*\n$")


if __name__ == "__main__":
    unittest.main()
