#!/usr/bin/env python3
"""`python -m deepuav.convert` on bags of all kinds that it makes itself, and `deepuav run` on what comes out. Skipped where no
Python has rosbags: that of .venv/ has it.

  convert_test.py DEEPUAV
"""
import contextlib
import io
import os
import random
import subprocess
import sys
import tempfile
import types
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SKIPPED = 77


def use_python_with_rosbags():
    """Goes on in an interpreter that has it."""
    for python in (Path(sys.executable), ROOT / ".venv/bin/python"):
        if python.exists() and subprocess.run([python, "-c", "import rosbags, numpy"], capture_output=True,
                                              check=False).returncode == 0:
            if python != Path(sys.executable):
                os.execv(python, [os.fspath(python), "-B", *sys.argv])
            return
    print("skipped: no Python has rosbags: scripts/test.sh makes one that has")
    sys.exit(SKIPPED)


if __name__ == "__main__":
    use_python_with_rosbags()

import numpy as np

import layered_scene
from bag_writer import Bag, START_NS
from jpeg_encoder import jpeg

# The package as it lies in the sources, without its compiled part, which this one does not need.
package = types.ModuleType("deepuav")
package.__path__ = [os.fspath(ROOT / "python/deepuav")]
sys.modules["deepuav"] = package
from deepuav import convert as module
from deepuav._bag_images import ImageError, raw_pixels

DEEPUAV = None
FRAMES = 20
KINDS = (".bag", ".db3", ".mcap")
# The camera looks along the body's x: its z is x, its x is -y, its y is -z.
CAMERA_IN_BODY = (0.5, -0.5, 0.5, -0.5)


def table(out, name):
    return [line.split(",") for line in (out / f"mav0/{name}/data.csv").read_text().splitlines()[1:]]


class ConvertTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cards = layered_scene.make_cards(random.Random(1))
        cls.pictures = [layered_scene.draw(cards, i * layered_scene.STEP_M, 0.2 * i * layered_scene.STEP_M)
                        for i in range(FRAMES)]
        cls.jpegs = [jpeg(rows) for rows in cls.pictures]

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="deepuav-convert-test-")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.out = self.folder / "out"

    def bag(self, kind=".mcap"):
        return Bag(Path(tempfile.mkdtemp(dir=self.folder)), kind)

    def flight(self, kind, compressed=False):
        """All sensors."""
        bag = self.bag(kind)
        bag.transform("base", "camera", CAMERA_IN_BODY, (0.3, 0, 0))
        bag.transform("base", "imu", (0.0, 0.0, 0.0, 1.0), (0.1, 0, 0))
        for i in range(FRAMES):
            time_ns = START_NS + i * 10**8
            bag.compressed(time_ns, self.jpegs[i]) if compressed else bag.image(time_ns, self.pictures[i])
            bag.info(time_ns)
            for k in range(10):
                bag.imu(time_ns + k * 10**7)
            bag.fix(time_ns)
            bag.pressure(time_ns)
        return bag.close()

    def convert(self, *words):
        """Status, what was printed, what was told of errors."""
        told, printed = io.StringIO(), io.StringIO()
        with contextlib.redirect_stderr(told), contextlib.redirect_stdout(printed):
            status = module.main([os.fspath(word) for word in words])
        return status, printed.getvalue(), told.getvalue()

    def refused(self, words, *parts):
        status, _, told = self.convert(*words)
        self.assertEqual((status, len(told.splitlines())), (1, 1), told)
        for part in parts:
            self.assertIn(part, told)
        self.assertFalse(self.out.exists())
        self.assertEqual([one.name for one in self.folder.iterdir() if one.name.startswith(".out")], [])

    def check_flight(self, ending):
        names = table(self.out, "cam0")
        self.assertEqual([int(row[0]) for row in names], [START_NS + i * 10**8 for i in range(FRAMES)])
        self.assertTrue(all(row[1] == f"{row[0]}{ending}" and (self.out / "mav0/cam0/data" / row[1]).exists() for row in names))
        imu = table(self.out, "imu0")
        self.assertEqual(len(imu), 10 * FRAMES)
        self.assertEqual([float(value) for value in imu[3][1:]], [0.1, 0.2, 0.3, 0, 0, 9.8])
        self.assertEqual([float(value) for value in table(self.out, "gps0")[0][1:]], [47.5, 8.25, 430.25, 2, 3, 4])
        pressure, altitude = map(float, table(self.out, "baro0")[0][1:])
        self.assertEqual(pressure, 95_000)
        self.assertAlmostEqual(altitude, 540.3, delta=0.5)  # Of the standard atmosphere's tables.
        text = (self.out / "mav0/cam0/sensor.yaml").read_text()
        self.assertIn("intrinsics: [200.0, 200.0, 159.5, 119.5]", text)
        self.assertIn("distortion_model: radial-tangential\ndistortion_coefficients: [0.0, 0.0, 0.0, 0.0, 0.0]", text)
        self.assertIn("resolution: [320, 240]", text)
        rate = float(text.partition("rate_hz: ")[2].split()[0])
        self.assertAlmostEqual(rate, 10)
        matrix = np.array([float(v) for v in text.partition("data: [")[2].partition("]")[0].split(",")]).reshape(4, 4)
        np.testing.assert_allclose(matrix, [[0, 0, 1, 0.2], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]], atol=1e-12)

    def test_bags_of_all_kinds_with_raw_images(self):
        for kind in KINDS:
            with self.subTest(kind):
                self.out = self.folder / f"raw{kind}"
                status, printed, told = self.convert(self.flight(kind), self.out)
                self.assertEqual((status, told), (0, ""))
                self.assertIn(f"{FRAMES} images, {10 * FRAMES} inertial samples, {FRAMES} fixes, {FRAMES} pressures", printed)
                self.check_flight(".png")
                first = (self.out / f"mav0/cam0/data/{START_NS}.png").read_bytes()
                self.assertEqual(first, module.encoded_image(types.SimpleNamespace(
                    encoding="mono8", height=240, width=320, step=320, is_bigendian=0,
                    data=np.frombuffer(b"".join(map(bytes, self.pictures[0])), np.uint8)))[0])

    def test_bags_of_all_kinds_with_compressed_images(self):
        for kind in KINDS:
            with self.subTest(kind):
                self.out = self.folder / f"compressed{kind}"
                file = self.flight(kind, compressed=True)
                status, _, told = self.convert(file if kind == ".bag" else file.parent, self.out)
                self.assertEqual((status, told), (0, ""))
                self.check_flight(".jpg")
                self.assertEqual((self.out / f"mav0/cam0/data/{START_NS}.jpg").read_bytes(), self.jpegs[0])

    def test_a_run_reads_what_comes_out(self):
        bag = self.bag()
        for i in range(FRAMES):
            bag.image(START_NS + i * 10**8, self.pictures[i])
            bag.fix(START_NS + i * 10**8, latitude=47.5 + 1e-6 * i)
            bag.pressure(START_NS + i * 10**8)
        bag.info(START_NS)
        self.assertEqual(self.convert(bag.close(), self.out)[0], 0)
        done = self.run_converted()
        self.assertEqual(done.returncode, 0, done.stderr)
        lines = [line for line in (self.folder / "run/trajectory.txt").read_text().splitlines() if line[0] != "#"]
        self.assertGreater(len(lines), FRAMES // 2)

    def test_pixels_of_all_encodings(self):
        def pixels(encoding, data, width, **more):
            data = np.array(data, np.uint8)
            return raw_pixels(types.SimpleNamespace(
                encoding=encoding, height=1, width=width, step=len(data), is_bigendian=more.get("big", 0), data=data)).tolist()

        self.assertEqual(pixels("rgb8", [1, 2, 3, 4, 5, 6], 2), [[[1, 2, 3], [4, 5, 6]]])
        self.assertEqual(pixels("bgr8", [1, 2, 3, 4, 5, 6], 2), [[[3, 2, 1], [6, 5, 4]]])
        self.assertEqual(pixels("bgra8", [1, 2, 3, 9], 1), [[[3, 2, 1]]])
        self.assertEqual(pixels("mono16", [1, 2], 1), [[513]])
        self.assertEqual(pixels("mono16", [1, 2], 1, big=1), [[258]])
        self.assertEqual(pixels("yuv422", [128, 7, 128, 8], 2), [[7, 8]])
        self.assertEqual(pixels("yuv422_yuy2", [7, 128, 8, 128], 2), [[7, 8]])
        self.assertEqual(pixels("mono8", [5, 6, 0, 0], 2), [[5, 6]], "rows may be padded")

    def test_bayer_patterns_become_colours(self):
        def mosaic_of(colours, pattern):
            mosaic = np.empty(colours.shape[:2], colours.dtype)
            for place in range(4):
                rows, columns = slice(place // 2, None, 2), slice(place % 2, None, 2)
                mosaic[rows, columns] = colours[rows, columns, "rgb".index(pattern[place])]
            return mosaic

        def pixels(mosaic, encoding, big=0):
            height, width = mosaic.shape
            return raw_pixels(types.SimpleNamespace(
                encoding=encoding, height=height, width=width, step=width * mosaic.itemsize, is_bigendian=big,
                data=np.frombuffer(mosaic.tobytes(), np.uint8)))

        y, x = np.mgrid[0:6, 0:9]
        ramps = np.stack((10 + 2 * x + 4 * y, 200 - 6 * x, 90 + 8 * y - 2 * x), axis=2)
        even = np.broadcast_to((50, 100, 150), ramps.shape)
        for pattern in ("rggb", "bggr", "gbrg", "grbg"):
            for bits, scale, order in ((8, 1, "<"), (16, 250, "<"), (16, 250, ">")):
                with self.subTest(pattern, bits=bits, order=order):
                    encoding, kind = f"bayer_{pattern}{bits}", f"{order}u{bits // 8}"
                    for colours, inside in ((even, np.s_[:, :]), (ramps, np.s_[1:-1, 1:-1])):
                        mosaic = mosaic_of((colours * scale).astype(kind), pattern)
                        found = pixels(mosaic, encoding, big=int(order == ">"))
                        np.testing.assert_array_equal(found[inside], (colours * scale)[inside])
        own = pixels(np.array([[9, 0], [0, 0]], np.uint8), "bayer_rggb8")
        self.assertEqual(own[0, 0].tolist(), [9, 0, 0])
        with self.assertRaisesRegex(ImageError, "9x1 of a Bayer pattern: expected at least 2x2"):
            pixels(np.zeros((1, 9), np.uint8), "bayer_rggb8")
        bag = self.bag()
        bag.image(START_NS, self.pictures[0], encoding="bayer_grbg8")
        self.assertEqual(self.convert(bag.close(), self.out)[0], 0)
        header = (self.out / f"mav0/cam0/data/{START_NS}.png").read_bytes()[16:26]
        self.assertEqual(header, bytes((0, 0, 1, 64, 0, 0, 0, 240, 8, 2)), "320x240, 8 bits, colours")

    def calibration(self, image_topic, **info):
        """The intrinsics and coefficients of a bag with one image."""
        bag = self.bag()
        bag.image(START_NS, self.pictures[0], topic=image_topic)
        bag.info(START_NS, **info)
        out = Path(tempfile.mkdtemp(dir=self.folder)) / "out"
        status, printed, told = self.convert(bag.close(), out)
        self.assertEqual((status, told, len(printed.splitlines())), (0, "", 1))
        lines = (out / "mav0/cam0/sensor.yaml").read_text().splitlines()
        return [line.partition(": ")[2] for line in lines if line.startswith(("intrinsics", "distortion_c"))]

    def test_rectified_images_have_the_lens_that_they_were_rectified_to(self):
        lens = {"coefficients": (-0.3, 0.1, 0, 0, 0), "projection": (180, 0, 150, -9, 0, 181, 110, 0, 0, 0, 1, 0)}
        of_p, of_k = ["[180.0, 181.0, 150.0, 110.0]", "[0.0, 0.0, 0.0, 0.0]"], "[200.0, 200.0, 159.5, 119.5]"
        for topic in ("/camera/image_rect", "/camera/image_rect_color", "/camera/image_rect/raw"):
            self.assertEqual(self.calibration(topic, **lens), of_p, topic)
        self.assertEqual(self.calibration("/camera/image_rect", model="rational_polynomial", **lens), of_p)
        self.assertEqual(self.calibration("/camera/image_raw", **lens), [of_k, "[-0.3, 0.1, 0.0, 0.0, 0.0]"])
        self.assertEqual(self.calibration("/camera/image_rect_raw")[0], of_k, "neither P nor a distortion")

    def test_a_rational_lens_is_plumb_bob_or_left_to_be_found(self):
        _, coefficients = self.calibration("/camera/image_raw", model="rational_polynomial",
                                           coefficients=(-0.3, 0.1, 0.01, 0.02, 0.03, 0, 0, 0))
        self.assertEqual(coefficients, "[-0.3, 0.1, 0.01, 0.02, 0.03]")
        bag = self.bag()
        bag.transform("imu", "camera", CAMERA_IN_BODY, (0.2, 0, 0))
        for i in range(FRAMES):
            bag.image(START_NS + i * 10**8, self.pictures[i])
        bag.imu(START_NS)
        bag.info(START_NS, model="rational_polynomial", coefficients=(0.4, 0.1, 0, 0, 0.01, 0.5, 0.2, 0.1))
        status, printed, told = self.convert(bag.close(), self.out)
        self.assertEqual((status, told), (0, ""))
        self.assertIn("/camera/camera_info: distortion is rational_polynomial, which is not supported", printed)
        self.assertFalse((self.out / "mav0/cam0/sensor.yaml").exists())
        self.assertIn("model: auto\nwidth: 320\nheight: 240\nfx: 200.0\nfy: 200.0\ncx: 159.5\ncy: 119.5\nrate_hz: 10.0\n",
                      (self.out / "mav0/camera.yaml").read_text())
        place = (self.out / "mav0/imu0/sensor.yaml").read_text().partition("data: [")[2].partition("]")[0]
        np.testing.assert_allclose([float(number) for number in place.split(",")],
                                   [0, -1, 0, 0, 0, 0, -1, 0, 1, 0, 0, -0.2, 0, 0, 0, 1], atol=1e-12)
        done = self.run_converted()
        self.assertEqual(done.returncode, 0, done.stderr)

    def run_converted(self):
        return subprocess.run([DEEPUAV, "run", self.out, "--out", self.folder / "run", "--log-level", "warn"],
                              capture_output=True, text=True, check=False,
                              env={**os.environ, "XDG_CACHE_HOME": os.fspath(self.folder / "cache")})

    def test_what_measures_nothing_is_left_out_and_counted(self):
        bag = self.bag()
        for recorded, i in enumerate((0, 2, 1, 3)):
            bag.image(START_NS + i, self.pictures[0], recorded_ns=START_NS + recorded)
        bag.fix(START_NS, status=-1)
        bag.fix(START_NS + 1, altitude=float("nan"))
        bag.pressure(START_NS, pascal=0.0)
        status, printed, _ = self.convert(bag.close(), self.out)
        self.assertEqual(status, 0)
        self.assertIn("3 images, 0 inertial samples, 0 fixes, 0 pressures", printed)
        for line in ("/camera/image_raw: 1 ", "/gps/fix: 2 ", "/pressure: 1 ", "no calibration"):
            self.assertIn(line, printed)
        self.assertEqual([one.name for one in (self.out / "mav0").iterdir()], ["cam0"])

    def test_topics_are_chosen(self):
        bag = self.bag()
        for side in ("left", "right"):
            bag.image(START_NS, self.pictures[0], topic=f"/{side}/image_raw")
            bag.info(START_NS, topic=f"/{side}/camera_info", focal=200 if side == "left" else 210)
        bag.imu(START_NS)
        file = bag.close()
        self.refused((file, self.out), "/left/image_raw, /right/image_raw", "--image", os.fspath(file))
        self.refused((file, self.out, "--image", "/up"), "topic /up", "/left/image_raw")
        self.refused((file, self.out, "--image", "/right/image_raw"), "'camera'", "'imu'", "--imu-from-camera")
        status, _, told = self.convert(file, self.out, "--image", "/right/image_raw", "--imu", "none")
        self.assertEqual((status, told), (0, ""))
        self.assertIn("intrinsics: [210.0", (self.out / "mav0/cam0/sensor.yaml").read_text())
        self.assertFalse((self.out / "mav0/imu0").exists())
        self.refused_existing(file)
        matrix = "0 0 1 0.5 -1 0 0 0 0 -1 0 0 0 0 0 1".split()
        again = self.folder / "again"
        self.assertEqual(self.convert(file, again, "--image", "/left/image_raw", "--imu-from-camera", *matrix)[0], 0)
        self.assertIn("0.0, 0.0, 1.0, 0.5", (again / "mav0/cam0/sensor.yaml").read_text())
        wrong = self.folder / "wrong"
        self.assertIn("rigid", self.convert(file, wrong, "--image", "/left/image_raw", "--imu-from-camera", *["1"] * 16)[2])

    def refused_existing(self, file):
        status, _, told = self.convert(file, self.out)
        self.assertEqual(status, 1)
        self.assertIn("new or empty", told)

    def test_bad_input_is_told_in_a_line(self):
        missing, wrong, damaged = (self.folder / name for name in ("absent.bag", "flight.txt", "damaged.bag"))
        wrong.write_bytes(b"x")
        self.refused((missing, self.out), "absent.bag", "expected a bag")
        self.refused((wrong, self.out), "'.txt'", "expected .bag, .db3 or .mcap")
        for kind in KINDS:
            damaged = self.folder / f"damaged{kind}"
            damaged.write_bytes(random.Random(1).randbytes(5000))
            self.refused((damaged, self.out), damaged.name, "cannot be read as a bag")
        cut = self.folder / "cut.mcap"
        whole = self.flight(".mcap").read_bytes()
        cut.write_bytes(whole[:len(whole) // 2])
        self.refused((cut, self.out), "cut.mcap")
        bag = self.bag()
        bag.imu(START_NS)
        self.refused((bag.close(), self.out), "/imu (sensor_msgs/msg/Imu)", "expected one of type Image or CompressedImage")

    def test_bad_images_and_calibrations(self):
        def with_image(**options):
            bag = self.bag()
            bag.image(START_NS, self.pictures[0], **options)
            return bag

        bag = with_image(topic="/camera/image_rect")
        bag.info(START_NS, coefficients=(-0.3, 0.1, 0, 0))
        self.refused((bag.close(), self.out), "of P, fx is 0.0", "above 0")
        self.refused((with_image(encoding="32FC1").close(), self.out), "/camera/image_raw", "'32FC1'", "mono8")
        self.refused((with_image(step=900).close(), self.out), "76800 bytes of 320x240, 900 a row", "expected at least 76800")
        bag = with_image()
        bag.image(START_NS + 1, self.pictures[0][:100])
        self.refused((bag.close(), self.out), "320x100", "expected 320x240")
        bag = self.bag()
        bag.compressed(START_NS, b"GIF89a", form="gif")
        self.refused((bag.close(), self.out), "'gif'", "expected JPEG or PNG")
        for options, found, expected in (({"model": "omni"}, "omni", "plumb_bob"),
                                         ({"model": "rational_polynomial", "coefficients": (1, 2)}, "2 coefficients", "4 or 5"),
                                         ({"coefficients": (1, 2)}, "2 coefficients", "4 or 5"),
                                         ({"focal": 0.0}, "fx is 0.0", "above 0"), ({"width": 640}, "640x240", "320x240")):
            bag = with_image()
            bag.info(START_NS, **options)
            self.refused((bag.close(), self.out), "/camera/camera_info", found, expected)

    def test_memory_does_not_grow_with_the_bag(self):
        import tracemalloc
        peaks = []
        for frames in (20, 200):
            bag = self.bag()
            for i in range(frames):
                bag.image(START_NS + i * 10**8, self.pictures[i % FRAMES])
            file = bag.close()
            tracemalloc.start()
            self.assertEqual(self.convert(file, self.folder / f"of{frames}")[0], 0)
            peaks.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
        self.assertLess(peaks[1], 1.5 * peaks[0] + 1_000_000, peaks)


if __name__ == "__main__":
    DEEPUAV = os.path.abspath(sys.argv.pop(1))
    unittest.main()
