#!/usr/bin/env python3
"""Programs of others against the installed library: found by CMake and pkg-config, compiled with flags of their own, they
give what the command line gives, to the byte.

  library_test.py CMAKE BUILD_FOLDER
"""
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import layered_scene

ROOT = Path(__file__).resolve().parent.parent
CMAKE = BUILD = None
FRAMES = 40
READOUT_MS = 8
RESULTS = ("trajectory.txt", "keyframes.txt", "points.ply", "frames.csv", "map.deepuav")
FLAGS = {"default": "", "native": "-O3 -march=native -ffast-math", "asan": "-O0 -g -fsanitize=address -D_GLIBCXX_ASSERTIONS"}


def with_inertial_sensor(scene):
    """Gives the sequence a rolling shutter and an inertial sensor that stands upright and turns a little."""
    camera = scene / "mav0/cam0/sensor.yaml"
    camera.write_text(camera.read_text() + f"readout_ms: {READOUT_MS}\n")
    imu = scene / "mav0/imu0"
    imu.mkdir()
    period = 5 * 10**6
    lines = ["#timestamp [ns],w_x,w_y,w_z,a_x,a_y,a_z"]
    for index in range(FRAMES * 20 + 40):
        lines.append(f"{9 * 10**8 + index * period},{0.001 * (index % 5)},{-0.002 * (index % 3)},0.001,0.1,-9.8,0.05")
    (imu / "data.csv").write_text("\n".join(lines) + "\n")
    (imu / "sensor.yaml").write_text("sensor_type: imu\nT_BS:\n  data: [0, -1, 0, 0.1, 1, 0, 0, 0.02, 0, 0, 1, 0, 0, 0, 0, 1]\n"
                                     "gyroscope_noise_density: 0.0002\naccelerometer_noise_density: 0.002\n")
    return scene


class LibraryTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="deepuav-library-test-")
        cls.scratch = Path(cls.folder.name)
        subprocess.run([CMAKE, "--install", BUILD, "--prefix", cls.scratch / "first"], check=True, capture_output=True)
        cls.prefix = cls.scratch / "moved"
        (cls.scratch / "first").rename(cls.prefix)
        cls.scene = layered_scene.euroc(cls.scratch / "scene", FRAMES)
        cls.inertial = with_inertial_sensor(layered_scene.euroc(cls.scratch / "inertial", FRAMES))
        cls.programs = {name: cls.build(name, flags) for name, flags in FLAGS.items()}
        cls.expected = cls.run_program(cls.scene)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def call(cls, *arguments, **environment):
        """stdout of a program that must succeed and leave stderr empty."""
        done = subprocess.run([os.fspath(word) for word in arguments], capture_output=True, text=True, cwd=cls.scratch,
                              env={**os.environ, "XDG_CACHE_HOME": str(cls.scratch / "cache"), **environment})
        if done.returncode != 0:
            raise AssertionError(f"{arguments}: status {done.returncode}\n{done.stdout}\n{done.stderr}")
        return done.stdout

    @classmethod
    def build(cls, name, flags):
        folder = cls.scratch / name
        cls.call(CMAKE, "-S", ROOT / "tests/consumer", "-B", folder, "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={cls.prefix}",
                 f"-DCMAKE_CXX_FLAGS=-Wall -Wextra -Wpedantic -Werror {flags}")
        cls.call(CMAKE, "--build", folder)
        return folder

    @classmethod
    def run_program(cls, scene, *arguments):
        """The output folder of the installed program."""
        out = Path(tempfile.mkdtemp(prefix="program-", dir=cls.scratch))
        cls.call(cls.prefix / "bin/deepuav", "run", scene, "--out", out, "--log-level", "off", *arguments)
        return out

    def call_consumer(self, flags, program, *arguments):
        environment = {}
        if flags == "asan":
            # OpenVINO's TBB, Debian's not, can be told to load nothing by RTLD_DEEPBIND, which AddressSanitizer refuses.
            openvino = next(self.prefix.glob("lib/**/libopenvino.so*")).parent
            environment = {"TBB_ENABLE_SANITIZERS": "1", "LD_LIBRARY_PATH": str(openvino), "ASAN_OPTIONS": "detect_leaks=0"}
        return self.call(self.programs[flags] / program, *arguments, **environment)

    def consume(self, scene, schedule="threaded", observer="none", flags="default"):
        """The output folder of a program against the library, and the numbers that it printed."""
        out = Path(tempfile.mkdtemp(prefix="consumer-", dir=self.scratch))
        text = self.call_consumer(flags, "consumer", "run", scene, out, schedule, observer)
        return out, [int(number) for number in text.split()]

    def assert_same(self, one, other):
        for name in RESULTS:
            self.assertEqual((one / name).read_bytes(), (other / name).read_bytes(), name)

    def assert_same_path(self, one, other):
        """Of runs that were done in another way: the map's file tells images' names, which pushed ones have not."""
        for name in RESULTS[:-1]:
            self.assertEqual((one / name).read_bytes(), (other / name).read_bytes(), name)

    def test_the_example_gives_the_same_bytes_under_all_flags(self):
        self.assertGreater(len((self.expected / "trajectory.txt").read_text().splitlines()), FRAMES // 2)
        for flags in self.programs:
            with self.subTest(flags):
                out = self.scratch / f"example-{flags}"
                text = self.call_consumer(flags, "example/slam_euroc", self.scene, out)
                self.assertRegex(text, r"^map 0: \d+ keyframes, \d+ landmarks\n$")
                self.assert_same_path(self.expected, out)

    def test_a_sequential_run_too(self):
        expected = self.run_program(self.scene, "--schedule", "sequential")
        self.assert_same(expected, self.expected)
        self.assert_same_path(expected, self.consume(self.scene, "sequential")[0])

    def test_watching_changes_nothing(self):
        plain, _ = self.consume(self.scene)
        for observer in ("slow", "throwing"):
            with self.subTest(observer):
                out, (frames, keyframes, maps, landmarks, dropped) = self.consume(self.scene, observer=observer)
                self.assert_same(plain, out)
                if observer == "slow":
                    self.assertEqual((frames, maps, dropped), (FRAMES, 1, 0))
                    self.assertGreater(keyframes, 2)
                    self.assertGreater(landmarks, 100)
                else:
                    self.assertEqual(frames, 1)

    def test_a_survey_is_watched_too(self):
        photographs, out = layered_scene.photographs(self.scene, self.scratch / "photographs"), self.scratch / "survey"
        text = self.call_consumer("default", "consumer", "survey", photographs, out)
        frames, keyframes, maps, landmarks, dropped = [int(number) for number in text.split()]
        self.assert_same(self.run_program(photographs), out)
        self.assertEqual((frames, dropped), (FRAMES, 0))
        poses = [line for line in (out / "keyframes.txt").read_text().splitlines() if not line.startswith("#")]
        self.assertGreaterEqual(keyframes, len(poses))
        self.assertGreater(min(maps, landmarks), 0)

    def test_inertial_samples_may_come_with_the_images(self):
        expected = self.run_program(self.inertial)
        with self.assertRaises(AssertionError):  # so that the samples are known to matter
            self.assert_same_path(expected, self.run_program(self.inertial, "--use", "camera"))
        for flags in ("default", "asan"):
            self.assert_same_path(expected, self.consume(self.inertial, flags=flags)[0])

    def test_live_leaves_out_what_comes_too_fast(self):
        out, _ = self.consume(self.scene, "live")
        self.assertIn('"schedule": "live"', (out / "summary.json").read_text())

    def test_live_what_is_kept_is_bounded(self):
        fed = 600_000
        for schedule, frames, least, most in (("live", "10000", 360_000, 540_000), ("threaded", "0", fed, fed)):
            with self.subTest(schedule):
                summary = json.loads(self.call_consumer("default", "consumer", "samples", self.scene, schedule, str(fed)))
                self.assertEqual(summary["options"]["system.max_records"], frames)
                kept = {sensor["sensor"]: sensor["samples"] for sensor in summary["sensors"]["found"]}
                self.assertEqual(set(kept), {"imu", "gnss", "barometer"})
                self.assertTrue(least <= min(kept.values()) <= max(kept.values()) <= most, kept)

    def test_a_run_over_a_dataset_can_be_stopped(self):
        self.assertLessEqual(int(self.call_consumer("default", "consumer", "stopped", self.scene)), 10)

    def test_matches_are_the_commands(self):
        first, second = sorted((self.scene / "mav0/cam0/data").iterdir())[:2]
        matches = self.call(self.programs["default"] / "consumer", "match", first, second)
        self.assertGreater(len(matches.splitlines()), 20)
        self.assertEqual(matches, self.call(self.prefix / "bin/deepuav", "match", first, second))

    def test_misuse_is_refused_by_one_exception(self):
        for flags in ("default", "asan"):
            self.call_consumer(flags, "consumer", "misuse", self.scene, self.expected / "map.deepuav")

    def test_a_lack_of_memory_is_told_by_it_too(self):
        for flags in ("default", "native"):
            self.call_consumer(flags, "consumer", "memory", self.scene, self.expected / "map.deepuav")

    def test_nothing_of_the_inside_is_shown(self):
        library = self.prefix / "lib/libdeepuav.so"
        if not library.exists():
            library = next(self.prefix.glob("lib/*/libdeepuav.so"))
        symbols = self.call("nm", "-D", "--defined-only", "-C", library).splitlines()
        names = [line.split(maxsplit=2)[2] for line in symbols]
        self.assertGreater(len(names), 20)
        for name in names:
            self.assertRegex(name, r"^(typeinfo (name )?for |vtable for )?deepuav::api::")
        self.assertNotIn(os.fsencode(ROOT), library.read_bytes())
        for header in (self.prefix / "include/deepuav/api").iterdir():
            for included in re.findall(r'#include [<"]([^>"]+)', header.read_text()):
                self.assertRegex(included, r"^(deepuav/api/\w+\.h|[a-z]+)$", header.name)
        package = next(self.prefix.glob("lib/**/DeepUavConfig.cmake")).read_text()
        self.assertNotIn("march", package)
        self.assertNotIn(str(ROOT), package)

    def test_the_debian_package_holds_all_of_it(self):
        if not shutil.which("dpkg-deb"):
            self.skipTest("no dpkg-deb")
        cpack = Path(CMAKE).with_name("cpack") if os.sep in CMAKE else "cpack"
        packed = self.scratch / "packed"
        self.call(cpack, "--config", Path(BUILD).resolve() / "CPackConfig.cmake", "-B", packed)
        package = next(packed.glob("deepuav_*.deb"))
        self.assertIn("libopencv-core", self.call("dpkg-deb", "--field", package, "Depends"))
        self.call("dpkg-deb", "--extract", package, packed / "root")
        models = self.call(packed / "root/usr/bin/deepuav", "models")
        self.assertIn(str(packed / "root/usr/share"), self.call(packed / "root/usr/bin/deepuav", "models", "--json"))
        self.assertNotIn("missing", models)
        files = {path.name for path in (packed / "root").rglob("*")}
        self.assertLessEqual({"libdeepuav.so", "slam.h", "DeepUavConfig.cmake", "deepuav.pc", "deepuav.1", "libopenvino_intel_cpu_plugin.so"},
                             files)

    def test_pkg_config_finds_it(self):
        if not shutil.which("pkg-config"):
            self.skipTest("no pkg-config")
        folder = next(self.prefix.glob("lib/**/deepuav.pc")).parent
        flags = self.call("pkg-config", "--cflags", "--libs", "deepuav", PKG_CONFIG_PATH=str(folder))
        source = self.scratch / "version.cc"
        source.write_text("#include <deepuav/api/options.h>\n#include <iostream>\n"
                          "int main() { std::cout << deepuav::api::Version(); }\n")
        self.call("c++", "-std=c++17", source, "-o", self.scratch / "version", *shlex.split(flags),
                  f"-Wl,-rpath,{folder.parent}")
        self.assertEqual(self.call(self.scratch / "version"), self.call(self.prefix / "bin/deepuav", "--version").strip())


if __name__ == "__main__":
    CMAKE, BUILD = sys.argv[1:3]
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
