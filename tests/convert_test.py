#!/usr/bin/env python3
"""`python -m deepuav.convert` on bags of all kinds that it makes itself, and `deepuav run` on what comes out. Skipped where no
Python has rosbags: that of .venv/ has it.

  convert_test.py DEEPUAV
"""
import os
import random
import types

from rosbags_python import use_python_with_rosbags

if __name__ == "__main__":
    use_python_with_rosbags()

import numpy as np

from bag_writer import START_NS
from convert_fixtures import CAMERA_IN_BODY, FRAMES, ConvertTest, module
from program_under_test import main

KINDS = (".bag", ".db3", ".mcap")


def table(out, name):
    return [line.split(",") for line in (out / f"mav0/{name}/data.csv").read_text().splitlines()[1:]]


class Convert(ConvertTest):
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
    main(__doc__)
