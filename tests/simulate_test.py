#!/usr/bin/env python3
"""`deepuav simulate` as its users meet it: the dataset, going on after an interruption, wrong use.

  simulate_test.py DEEPUAV
"""
import resource
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FAILURE, WRONG_USE = 1, 2
DEEPUAV = None
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
FRAMES = 9  # 0 to 2 s at 4 Hz


def call(*arguments):
    return subprocess.run([DEEPUAV, *map(str, arguments)], capture_output=True, text=True, timeout=200, check=False)


def files_of(folder):
    return {str(file.relative_to(folder)): file.read_bytes() for file in sorted(folder.rglob("*")) if file.is_file()}


def rows_of(file):
    return [line.split(",") for line in file.read_text().splitlines() if not line.startswith("#")]


def png_format(file):
    """Width, height, bits and colour type of a PNG."""
    return struct.unpack(">IIBB", file.read_bytes()[16:26])


class SimulateTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory(prefix="deepuav-simulate-test-")
        cls.folder = Path(cls.scratch.name)
        cls.flight = cls.folder / "flight.yaml"
        cls.flight.write_text(FLIGHT)
        cls.dataset = cls.folder / "dataset"
        cls.result = cls.simulate(cls.dataset)

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

    def test_help_and_list(self):
        self.assertIn("Examples", call("simulate", "--help").stdout)
        listed = call("simulate", "--list").stdout
        for file in (ROOT / "flights").glob("*.yaml"):
            self.assertIn(f"  {file.stem} ", listed)
        self.assertIn("village", listed)

    def test_dataset_is_complete(self):
        self.expect_success(self.result)
        mav0 = self.dataset / "mav0"
        frames = rows_of(mav0 / "cam0/data.csv")
        self.assertEqual(len(frames), FRAMES)
        for stamp, name in frames:
            self.assertEqual(name, f"{stamp}.jpg")
            self.assertGreater((mav0 / "cam0/data" / name).stat().st_size, 500)
        truth = rows_of(self.dataset / "groundtruth_cam0.csv")
        self.assertEqual([row[0] for row in truth], [row[0] for row in frames])
        self.assertEqual(len(rows_of(mav0 / "imu0/data.csv")), 401)
        self.assertEqual(len(rows_of(mav0 / "state_groundtruth_estimate0/data.csv")), 401)
        self.assertEqual({len(row) for row in rows_of(mav0 / "state_groundtruth_estimate0/data.csv")}, {17})
        self.assertEqual(len(rows_of(mav0 / "baro0/data.csv")), 41)
        self.assertTrue({len(row) for row in rows_of(mav0 / "gps0/data.csv")} <= {7})
        for sensor in ("cam0", "imu0", "gps0", "baro0"):
            self.assertIn("T_BS", (mav0 / sensor / "sensor.yaml").read_text())

    def test_run_opens_it_and_eval_takes_its_truth(self):
        result = call("run", self.dataset, "--out", self.folder / "run", "--set", "features.model=absent.onnx",
                      "--log-level", "warn")
        self.expect_failure(result, FAILURE, "absent.onnx")
        estimate = self.folder / "estimate.txt"
        lines = []
        for row in rows_of(self.dataset / "groundtruth_cam0.csv"):
            p, q = [2 * float(x) for x in row[1:4]], row[4:8]  # twice as large: Sim3 finds it
            lines.append(f"{row[0][:-9]}.{row[0][-9:]} {p[0]} {p[1]} {p[2]} {q[1]} {q[2]} {q[3]} {q[0]}")
        estimate.write_text("\n".join(lines) + "\n")
        result = call("eval", self.dataset, estimate, "--json", "-")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stdout, r'"rmse": \d(\.\d+)?e-\d\d')

    def test_body_truth_and_camera_truth_agree(self):
        states = {row[0]: [float(x) for x in row[1:4]]
                  for row in rows_of(self.dataset / "mav0/state_groundtruth_estimate0/data.csv")}
        for row in rows_of(self.dataset / "groundtruth_cam0.csv"):
            offset = [float(a) - b for a, b in zip(row[1:4], states[row[0]])]
            self.assertAlmostEqual(sum(x * x for x in offset) ** 0.5, (0.1 ** 2 + 0.03 ** 2) ** 0.5, places=9)

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

    def test_seed_changes_the_flight(self):
        other = self.folder / "seed"
        self.expect_success(self.simulate(other, "--seed", 2, "--frames", 1))
        for file in ("mav0/imu0/data.csv", "mav0/gps0/data.csv", "mav0/baro0/data.csv", "groundtruth_cam0.csv"):
            self.assertNotEqual((other / file).read_bytes(), (self.dataset / file).read_bytes(), file)

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

    def test_written_options_are_a_flight(self):
        again = self.folder / "again"
        result = call("simulate", "--flight", self.dataset / "simulation.yaml", "--out", again)
        self.expect_success(result)
        self.assertEqual(files_of(again), files_of(self.dataset))

    def test_hall_has_no_fixes(self):
        out = self.folder / "indoors"
        self.expect_success(self.simulate(out, "--frames", 1, "--set", "gnss.present=false"))
        self.assertFalse((out / "mav0/gps0").exists())
        self.assertTrue((out / "mav0/baro0/data.csv").exists())

    def test_true_orthophoto(self):
        out = self.folder / "from_above"
        self.expect_success(self.simulate(out, "--frames", "2", "--orthophoto", "1"))
        for name in ("orthophoto.tif", "dsm.tif"):
            self.assertEqual((out / name).read_bytes()[:4], b"II*\0")

    def test_depth_and_flow(self):
        out = self.folder / "depth"
        self.expect_success(self.simulate(out, "--frames", 2, "--set", "output.depth=true", "--set",
                                          "output.flow=true", "--set", "output.image_format=png"))
        grey, colour = 0, 2
        for sensor, kind in (("depth0", (96, 64, 16, grey)), ("flow0", (96, 64, 16, colour)),
                             ("cam0", (96, 64, 8, grey))):
            images = sorted((out / "mav0" / sensor / "data").iterdir())
            self.assertEqual(len(images), 2, sensor)
            self.assertEqual({png_format(image) for image in images}, {kind}, sensor)
        self.assertIn("depth_unit_m: 0.01", (out / "mav0/depth0/sensor.yaml").read_text())

    def test_moving_masks_come_beside_unchanged_images(self):
        out, cars = self.folder / "moving", ["--set", "scene.cars_per_km=300", "--set", "output.image_format=png"]
        self.expect_success(self.simulate(out, "--frames", 2, *cars))
        before = files_of(out)
        kept = {image: image.stat().st_mtime_ns for image in (out / "mav0/cam0/data").iterdir()}
        self.expect_success(self.simulate(out, "--frames", 2, "--moving-mask", *cars))
        after = files_of(out)
        masks = {name: after.pop(name) for name in list(after) if name.startswith("mav0/moving0/")}
        self.assertEqual(after, before)
        self.assertEqual({image: image.stat().st_mtime_ns for image in kept}, kept)
        self.assertIn("moving: 255", masks.pop("mav0/moving0/sensor.yaml").decode())
        self.assertEqual({Path(name).name for name in masks}, {image.name for image in kept})
        self.assertEqual({png_format(out / name) for name in masks}, {(96, 64, 8, 0)})
        at_once = self.folder / "moving_at_once"
        self.expect_success(self.simulate(at_once, "--frames", 2, "--moving-mask", *cars))
        self.assertEqual(files_of(at_once), files_of(out))

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

    def test_a_long_course_is_planned_soon(self):
        out = self.folder / "ten-laps"
        began = time.monotonic()
        self.expect_success(call("simulate", "--flight", "orbit", "--frames", 1, "--out", out, "--set",
                                 "course.laps=20"))
        self.assertLess(time.monotonic() - began, 100)

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

    def test_shipped_flights_can_be_flown(self):
        for file in sorted((ROOT / "flights").glob("*.yaml")):
            with self.subTest(flight=file.stem):
                out = self.folder / "shipped" / file.stem
                self.expect_success(call("simulate", "--flight", file.stem, "--out", out, "--frames", 1))
                truth = rows_of(out / "groundtruth_cam0.csv")
                least_s = 30
                self.assertGreater(int(truth[-1][0]) - int(truth[0][0]), least_s * 1e9)


if __name__ == "__main__":
    DEEPUAV = sys.argv.pop(1)
    unittest.main()
