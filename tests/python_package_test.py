#!/usr/bin/env python3
"""The Python package: pip makes a wheel of the sources and installs it into a fresh environment, where it gives what the
command line gives, to the byte. Skipped where there is no package index, or no ccache to spare a second compilation.

  python_package_test.py BUILD_FOLDER
"""
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import layered_scene
from python_package_scripts import LINES, PUSHED, PLACED, THREADS, UNLOCKED, WATCHED, INTERRUPTED

ROOT = Path(__file__).resolve().parent.parent
BUILD = None
FRAMES = 40
PYTHON = "/usr/bin/python3"
TIMEOUT_S = 300
PACKAGES = ("scikit-build-core>=0.10", "nanobind>=2.2")
SKIPPED = 77


def run(*words, **options):
    done = subprocess.run([os.fspath(word) for word in words], capture_output=True, text=True, **options)
    if done.returncode != 0:
        raise AssertionError(f"{words}: status {done.returncode}\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}")
    return done.stdout


def skip(why):
    print(f"skipped: {why}")
    sys.exit(SKIPPED)


def cached(*names):
    """What the build was configured with, as settings of the wheel's; what it did not ask is left out."""
    text = (BUILD / "CMakeCache.txt").read_text()
    found = {name: re.search(rf"^{name}:\w+=(.*)$", text, re.MULTILINE) for name in names}
    return {f"cmake.define.{name}": match.group(1) for name, match in found.items() if match}


def with_truth(scene):
    """Says where the camera of a weaving sequence was."""
    folder = scene / "mav0/state_groundtruth_estimate0"
    folder.mkdir()
    places = [layered_scene.weaving(index) for index in range(FRAMES)]
    lines = [f"{10**9 + index * 10**8},{x},{y},0,1,0,0,0" for index, (x, y) in enumerate(places)]
    (folder / "data.csv").write_text("#timestamp [ns],x,y,z,q_w,q_x,q_y,q_z\n" + "\n".join(lines) + "\n")


def make_wheel(scratch):
    """Of the sources, compiled beside the build and in the same way, so that ccache gives its objects again."""
    makers = scratch / "makers"
    run(PYTHON, "-m", "venv", makers)
    quiet = ("--quiet", "--disable-pip-version-check", "--only-binary=:all:")
    install = subprocess.run([makers / "bin/pip", "install", *quiet, *PACKAGES], capture_output=True, text=True)
    if install.returncode != 0:
        skip("no package index: " + install.stderr.strip().splitlines()[-1])
    environment = {**os.environ, "PATH": f"{makers / 'bin'}:{os.environ['PATH']}", "CMAKE_BUILD_PARALLEL_LEVEL": "2"}
    settings = {"build-dir": BUILD.with_name(BUILD.name + "-wheel"),
                **cached("CMAKE_CXX_COMPILER", "DEEPUAV_OPENVINO", "DEEPUAV_SIMULATION", "DEEPUAV_REPORT", "DEEPUAV_MAVLINK",
                         "DEEPUAV_PYMAVLINK")}
    run(makers / "bin/pip", "wheel", ROOT, "--no-deps", "--no-build-isolation", "--wheel-dir", scratch / "wheels",
        *(f"--config-settings={name}={value}" for name, value in settings.items()), env=environment)
    return next((scratch / "wheels").glob("deepuav-*.whl"))


class PackageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="deepuav-python-test-")
        cls.scratch = Path(cls.folder.name)
        wheel = make_wheel(cls.scratch)
        run(PYTHON, "-m", "venv", cls.scratch / "fresh")
        cls.bin = cls.scratch / "fresh/bin"
        run(cls.bin / "pip", "install", "--quiet", "--disable-pip-version-check", wheel)
        cls.environment = {"PATH": "/usr/bin:/bin", "HOME": str(cls.scratch)}
        layered_scene.euroc(cls.scratch / "scene", FRAMES)
        cls.call(BUILD / "deepuav", "run", "scene", "--out", "program", "--log-level", "off")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def call(cls, *words):
        return run(*words, cwd=cls.scratch, env=cls.environment, timeout=TIMEOUT_S)

    def assert_same(self, folder):
        for name in ("trajectory.txt", "keyframes.txt", "points.ply", "frames.csv"):
            self.assertEqual((self.scratch / "program" / name).read_bytes(), (self.scratch / folder / name).read_bytes(), name)

    def test_a_dataset_gives_the_same_bytes(self):
        self.call(self.bin / "python", "-c", LINES)
        self.assert_same("python")

    def test_pushed_arrays_give_the_same_bytes(self):
        done = subprocess.run([self.bin / "python", "-c", PUSHED], cwd=self.scratch, env=self.environment, capture_output=True,
                              text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))  # no word of what was leaked
        self.assert_same("pushed")

    def test_fixes_place_a_run_while_it_goes_on(self):
        # As long as a second try takes, where the first one is too early.
        layered_scene.euroc(self.scratch / "weaving", 2 * FRAMES, path=layered_scene.weaving)
        run(self.bin / "python", "-B", "-c", PLACED, cwd=self.scratch, timeout=TIMEOUT_S,
            env={**self.environment, "PYTHONPATH": str(Path(layered_scene.__file__).parent)})

    def test_several_threads_may_match(self):
        self.call(self.bin / "python", "-c", THREADS)

    def test_other_threads_go_on_meanwhile(self):
        self.call(self.bin / "python", "-c", UNLOCKED)

    def test_watchers_are_told_what_they_missed_and_of_a_new_beginning(self):
        layered_scene.euroc(self.scratch / "rolling", FRAMES, path=layered_scene.weaving, readout_s=0.04)
        self.call(self.bin / "python", "-c", WATCHED)

    def test_an_interrupt_ends_a_run(self):
        slow = self.scratch / "slow/mav0/cam0"
        shutil.copytree(self.scratch / "scene", self.scratch / "slow")
        names = [line.split(",")[1] for line in (slow / "data.csv").read_text().splitlines()[1:]]
        (slow / "data.csv").write_text("".join(f"{index * 10**12},{name}\n" for index, name in enumerate(names)))
        process = subprocess.Popen([self.bin / "python", "-c", INTERRUPTED], cwd=self.scratch, env=self.environment,
                                   stdout=subprocess.PIPE, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.kill)
        self.assertEqual(process.stdout.readline(), "going\n")
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(60), 9)
        self.assertTrue((self.scratch / "interrupted/summary.json").exists())

    def test_the_example_goes_through_a_flight(self):
        flight = layered_scene.euroc(self.scratch / "first/flight", FRAMES, path=layered_scene.weaving)
        with_truth(flight)
        told = self.call(self.bin / "python", ROOT / "examples/python/first_flight.py", self.scratch / "first")
        self.assertLess(float(re.search(r"ATE (\S+) m over \d+ poses", told).group(1)), 0.1)
        self.assertGreater(int(re.search(r"(\d+) matches", told).group(1)), 20)

    def test_the_command_line_comes_along(self):
        self.call(self.bin / "deepuav", "run", "scene", "--out", "command", "--log-level", "off")
        self.assert_same("command")
        self.assertEqual(self.call(self.bin / "python", "-m", "deepuav", "--version"),
                         self.call(BUILD / "deepuav", "--version"))

    def test_bags_can_be_converted(self):
        self.assertIn("--imu-from-camera", self.call(self.bin / "python", "-m", "deepuav.convert", "--help"))
        requires = next((self.scratch / "fresh/lib").glob("python3*/site-packages/deepuav-*.dist-info/METADATA")).read_text()
        self.assertRegex(requires, r"Requires-Dist: rosbags[^\n]*extra == ['\"]convert['\"]")

    def test_it_has_types(self):
        package = next((self.scratch / "fresh/lib").glob("python3*/site-packages/deepuav"))
        self.assertTrue((package / "py.typed").exists())
        stub = (package / "_deepuav.pyi").read_text()
        for name in ("class Slam", "class Result", "class Map", "def feed(self"):
            self.assertIn(name, stub)

    def test_openvino_is_the_one_that_the_library_is_linked_with(self):
        setup = (ROOT / "scripts/setup.sh").read_text()
        version = re.search(r"openvino_version=([0-9.]+)", setup).group(1)
        self.assertEqual(set(re.findall(r"openvino==([0-9.]+)", (ROOT / "pyproject.toml").read_text())), {version})
        version = re.search(r"pymavlink_version=([0-9.]+)", setup).group(1)
        self.assertEqual(set(re.findall(r"pymavlink==([0-9.]+)", (ROOT / "pyproject.toml").read_text())), {version})


if __name__ == "__main__":
    BUILD = Path(sys.argv[1]).resolve()
    if not shutil.which("ccache"):
        skip("no ccache: everything would be compiled again")
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
