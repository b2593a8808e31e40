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
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer as Writer2
from rosbags.typesys import Stores, get_typestore

import layered_scene
from jpeg_encoder import jpeg

# The package as it lies in the sources, without its compiled part, which this one does not need.
package = types.ModuleType("deepuav")
package.__path__ = [os.fspath(ROOT / "python/deepuav")]
sys.modules["deepuav"] = package
from deepuav import convert as module
from deepuav._bag_images import raw_pixels

DEEPUAV = None
FRAMES = 20
START_NS = 1_700_000_000 * 10**9
KINDS = (".bag", ".db3", ".mcap")
# The camera looks along the body's x: its z is x, its x is -y, its y is -z.
CAMERA_IN_BODY = (0.5, -0.5, 0.5, -0.5)
IMAGE, COMPRESSED, INFO, IMU, FIX, PRESSURE, TRANSFORMS = (
    "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/NavSatFix", "sensor_msgs/msg/FluidPressure", "tf2_msgs/msg/TFMessage")


class Bag:
    """A bag that is written: `add(topic, type, time_ns, fields...)`."""

    def __init__(self, folder, kind):
        self.is1 = kind == ".bag"
        self.store = get_typestore(Stores.ROS1_NOETIC if self.is1 else Stores.ROS2_HUMBLE)
        if self.is1:
            self.file = folder / "flight.bag"
            self.writer = Writer1(self.file)
            definitions = ("tf2_msgs/msg/TFMessage",)
            if definitions[0] not in self.store.fielddefs:
                from rosbags.typesys import get_types_from_msg
                self.store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TRANSFORMS))
        else:
            plugin = StoragePlugin.MCAP if kind == ".mcap" else StoragePlugin.SQLITE3
            self.writer = Writer2(folder / "flight", version=9, storage_plugin=plugin)
            self.file = folder / f"flight/flight{kind}"
        self.writer.open()
        self.connections = {}

    def make(self, name, **fields):
        return self.store.types[name](**fields)

    def header(self, time_ns, frame):
        stamp = self.make("builtin_interfaces/msg/Time", sec=time_ns // 10**9, nanosec=time_ns % 10**9)
        more = {"seq": 0} if self.is1 else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **more)

    def vector(self, x, y, z):
        return self.make("geometry_msgs/msg/Vector3", x=float(x), y=float(y), z=float(z))

    def quaternion(self, x, y, z, w):
        return self.make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def add(self, topic, kind, time_ns, message):
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, kind, typestore=self.store)
        serialise = self.store.serialize_ros1 if self.is1 else self.store.serialize_cdr
        self.writer.write(self.connections[topic], time_ns, serialise(message, kind))

    def image(self, time_ns, rows, encoding="mono8", topic="/camera/image_raw", step=0, recorded_ns=None):
        data = np.frombuffer(b"".join(bytes(row) for row in rows), np.uint8)
        width = layered_scene.WIDTH
        step = step or len(data) // len(rows)
        self.add(topic, IMAGE, recorded_ns or time_ns, self.make(
            IMAGE, header=self.header(time_ns, "camera"), height=len(rows), width=width, encoding=encoding, is_bigendian=0,
            step=step, data=data))

    def compressed(self, time_ns, data, form="jpeg", topic="/camera/image_raw/compressed"):
        self.add(topic, COMPRESSED, time_ns, self.make(COMPRESSED, header=self.header(time_ns, "camera"), format=form,
                                                       data=np.frombuffer(data, np.uint8)))

    def info(self, time_ns, topic="/camera/camera_info", model="plumb_bob", coefficients=(0, 0, 0, 0, 0), focal=None,
             width=layered_scene.WIDTH):
        focal = layered_scene.FOCAL_PX if focal is None else focal
        k = [focal, 0, (layered_scene.WIDTH - 1) / 2, 0, focal, (layered_scene.HEIGHT - 1) / 2, 0, 0, 1]
        names = "DKRP" if self.is1 else "dkrp"
        values = (coefficients, k, np.eye(3).ravel(), np.zeros(12))
        roi = self.make("sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
        self.add(topic, INFO, time_ns, self.make(
            INFO, header=self.header(time_ns, "camera"), height=layered_scene.HEIGHT, width=width, distortion_model=model,
            binning_x=0, binning_y=0, roi=roi, **{name: np.array(value, float) for name, value in zip(names, values)}))

    def imu(self, time_ns, turn=(0.1, 0.2, 0.3), force=(0, 0, 9.8), covariance=0.0, topic="/imu"):
        none = np.zeros(9)
        self.add(topic, IMU, time_ns, self.make(
            IMU, header=self.header(time_ns, "imu"), orientation=self.quaternion(0.0, 0.0, 0.0, 1.0), orientation_covariance=none,
            angular_velocity=self.vector(*turn), angular_velocity_covariance=np.full(9, covariance),
            linear_acceleration=self.vector(*force), linear_acceleration_covariance=none))

    def fix(self, time_ns, latitude=47.5, altitude=430.25, status=0, topic="/gps/fix"):
        state = self.make("sensor_msgs/msg/NavSatStatus", status=status, service=1)
        self.add(topic, FIX, time_ns, self.make(
            FIX, header=self.header(time_ns, "gps"), status=state, latitude=latitude, longitude=8.25, altitude=altitude,
            position_covariance=np.diag((4.0, 9.0, 16.0)).ravel(), position_covariance_type=2))

    def pressure(self, time_ns, pascal=95_000.0, topic="/pressure"):
        self.add(topic, PRESSURE, time_ns, self.make(PRESSURE, header=self.header(time_ns, "baro"), fluid_pressure=pascal,
                                                     variance=0.0))

    def transform(self, parent, child, rotation, translation):
        one = self.make("geometry_msgs/msg/TransformStamped", header=self.header(START_NS, parent), child_frame_id=child,
                        transform=self.make("geometry_msgs/msg/Transform", translation=self.vector(*translation),
                                            rotation=self.quaternion(*rotation)))
        self.add("/tf_static", TRANSFORMS, START_NS, self.make(TRANSFORMS, transforms=[one]))

    def close(self):
        self.writer.close()
        return self.file


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
        done = subprocess.run([DEEPUAV, "run", self.out, "--out", self.folder / "run", "--log-level", "warn"],
                              capture_output=True, text=True, check=False,
                              env={**os.environ, "XDG_CACHE_HOME": os.fspath(self.folder / "cache")})
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

        self.refused((with_image(encoding="bayer_rggb8").close(), self.out), "/camera/image_raw", "'bayer_rggb8'", "mono8")
        self.refused((with_image(step=900).close(), self.out), "76800 bytes of 320x240, 900 a row", "expected at least 76800")
        bag = with_image()
        bag.image(START_NS + 1, self.pictures[0][:100])
        self.refused((bag.close(), self.out), "320x100", "expected 320x240")
        bag = self.bag()
        bag.compressed(START_NS, b"GIF89a", form="gif")
        self.refused((bag.close(), self.out), "'gif'", "expected JPEG or PNG")
        for options, found, expected in (({"model": "rational_polynomial"}, "rational_polynomial", "plumb_bob"),
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
