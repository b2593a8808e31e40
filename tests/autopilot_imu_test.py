#!/usr/bin/env python3
"""`deepuav live --mavlink-imu`: a camera on the network and an autopilot, made with pymavlink, play a real flight together: its
images, and its inertial samples as HIGHRES_IMU on a clock of the autopilot's own. No map is given.

  autopilot_imu_test.py DEEPUAV      (pymavlink in PYTHONPATH)

Exits with 77, which ctest shows as skipped, where there is no sequence in $DEEPUAV_SHARED.
"""
import collections
import csv
import json
import math
import os
import signal
import statistics
import struct
import tempfile
import threading
import time
import unittest
from bisect import bisect_left
from pathlib import Path

from pymavlink.dialects.v20 import common

import autopilot_test
import command_test_data as data
import live_test
from program_under_test import TIMEOUT_S, main

SEQUENCE = Path(os.environ.get("DEEPUAV_SHARED", "/nowhere")) / "data/euroc_mh01_excerpt"
WIDTH, HEIGHT = 752, 480
ENDLESS = 0x7FFFFFF0
# So that a machine that others use, too, keeps up: every second image, at half its size.
RATE_HZ, EVERY, WORKING_PIXELS = 10, 2, 90_000
REST_S = 1.0  # Of the sequence's end, surely.
RUN_UP_S = 1.0  # Of the still image, once the autopilot was asked.
ODOMETRY_WANTED = 100
# A young map bends: on the way metres were 2 to 10 % off. A wrong unit, axis or clock puts them off by far more.
METRES_OFF, HEIGHT_OFF_M = 0.15, 0.02
SET_MESSAGE_INTERVAL, HIGHRES_IMU = 511, 105
MEASURED_ALL = 0x3F
# A camera that looks ahead: the body's x, y, z are the camera's z, x, y.
BODY_FROM_CAMERA = ((0, 0, 1), (1, 0, 0), (0, 1, 0))
CAMERA_YAML = """model: radial_tangential
width: 752
height: 480
fx: 458.654
fy: 457.296
cx: 367.215
cy: 248.375
distortion: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
rate_hz: 10
"""
# Of the sequence's mav0/cam0/sensor.yaml: T_BS, whose body is the inertial sensor.
SENSOR_FROM_CAMERA = ((0.0148655429818, -0.999880929698, 0.00414029679422),
                      (0.999557249008, 0.0149672133247, 0.025715529948),
                      (-0.0257744366974, 0.00375618835797, 0.999660727178))
CAMERA_IN_SENSOR_M = (-0.0216401454975, -0.064676986768, 0.00981073058949)


def times(matrix, vector):
    return tuple(sum(a * b for a, b in zip(row, vector)) for row in matrix)


def transposed(matrix):
    return tuple(zip(*matrix))


def body_of(sensor_vector):
    return times(BODY_FROM_CAMERA, times(transposed(SENSOR_FROM_CAMERA), sensor_vector))


def turned(q, v):
    """By the unit quaternion w, x, y, z."""
    w, u = q[0], q[1:]
    cross = lambda a, b: (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    t = cross(u, v)
    return tuple(v[i] + 2 * (w * t[i] + cross(u, t)[i]) for i in range(3))


def rows(file):
    with file.open(newline="") as lines:
        return [row for row in csv.reader(lines) if row and not row[0].startswith("#")]


class Flight:
    """The sequence, which ends at rest, and back: time runs backwards then, so that turns change their sign and forces do not.
    Seconds from its first image."""

    def __init__(self):
        images = rows(SEQUENCE / "mav0/cam0/data.csv")[::EVERY]
        begin_ns = int(images[0][0])
        seconds = lambda text: 1e-9 * (int(text) - begin_ns)
        self.images = [(seconds(time_ns), (SEQUENCE / "mav0/cam0/data" / name.strip()).read_bytes()) for time_ns, name in images]
        self.turn_back = self.images[-1][0]
        self.images += [(2 * self.turn_back - t, image) for t, image in self.images[-2::-1]]
        self.samples = []
        for row in rows(SEQUENCE / "mav0/imu0/data.csv"):
            values = tuple(map(float, row[1:7]))
            self.samples.append((seconds(row[0]), body_of(values[3:]), body_of(values[:3])))
        # What the gyroscope shows at rest would change its sign, too.
        rest = [turn for t, _, turn in self.samples if self.turn_back - REST_S < t < self.turn_back]
        bias = [sum(axis) / len(rest) for axis in zip(*rest)]
        self.samples = [(t, force, tuple(v - b for v, b in zip(turn, bias))) for t, force, turn in self.samples]
        back = [(2 * self.turn_back - t, force, tuple(-v for v in turn)) for t, force, turn in reversed(self.samples)
                if 0 <= t < self.turn_back]
        self.samples = [sample for sample in self.samples if 0 <= sample[0] <= self.turn_back] + back
        # Where the sensor, the autopilot's body, was.
        in_camera = tuple(-v for v in times(transposed(SENSOR_FROM_CAMERA), CAMERA_IN_SENSOR_M))
        self.truth = []
        for row in rows(SEQUENCE / "groundtruth_cam0.csv"):
            values = tuple(map(float, row[1:8]))
            arm = turned(values[3:], in_camera)
            self.truth.append((seconds(row[0]), tuple(p + a for p, a in zip(values[:3], arm))))

    def position(self, t):
        """Nothing outside of the truth."""
        t = min(t, 2 * self.turn_back - t)
        after = bisect_left(self.truth, (t,))
        if not 0 < after < len(self.truth):
            return None
        (t0, p0), (t1, p1) = self.truth[after - 1], self.truth[after]
        share = (t - t0) / (t1 - t0)
        return tuple(a + share * (b - a) for a, b in zip(p0, p1))

    def speed(self, t, step=0.02):
        """m/s; nothing outside of the truth."""
        before, after = self.position(t - step), self.position(t + step)
        return math.dist(before, after) / (2 * step) if before and after else None


class FlightCamera(live_test.Camera):
    """Shows the first image until the flight is to begin. As a video, whose times are the images' own: those of their arrival
    would be as far off as this process is held up."""

    def __init__(self, flight):
        self.flight, self.may_begin, self.began = flight, threading.Event(), None
        super().__init__()

    @staticmethod
    def video_head(image):
        """Of an AVI without end."""
        head = bytearray(data.mjpeg_avi([image], RATE_HZ, WIDTH, HEIGHT))
        movie = head.index(b"movi")
        struct.pack_into("<I", head, 4, ENDLESS)
        struct.pack_into("<I", head, movie - 4, ENDLESS)
        return bytes(head[:movie + 4])

    def serve(self, request):
        request.send_response(200)
        request.send_header("Content-Type", "video/x-msvideo")
        request.end_headers()
        images = [image for _, image in self.flight.images]
        try:
            request.wfile.write(self.video_head(images[0]))
            start, count, shown = time.monotonic(), 0, 0
            while not self.refuses:
                due = start + count / RATE_HZ
                time.sleep(max(0, due - time.monotonic()))
                if self.may_begin.is_set() and self.began is None:
                    self.began = due
                image = images[min(shown, len(images) - 1)]
                request.wfile.write(b"00dc" + struct.pack("<I", len(image)) + image + b"\0" * (len(image) % 2))
                shown += self.began is not None
                count += 1
        except OSError:
            pass  # Nobody looks any more.

    def begin(self):
        """When the first image was due."""
        self.may_begin.set()
        end = time.monotonic() + TIMEOUT_S
        while self.began is None:
            if time.monotonic() > end:
                raise AssertionError("nobody looks")
            time.sleep(1 / RATE_HZ)
        return self.began


class FlyingAutopilot(autopilot_test.Autopilot):
    """Plays the flight's samples once it was asked for them."""

    def __init__(self, flight):
        self.flight, self.began, self.interval_us = flight, None, None
        self.samples_writer = common.MAVLink(None, srcSystem=1, srcComponent=autopilot_test.AUTOPILOT)
        super().__init__()

    def asked(self):
        return [message for _, _, message in self.of("COMMAND_LONG")
                if (message.command, message.param1) == (SET_MESSAGE_INTERVAL, HIGHRES_IMU)]

    def play(self):
        for t, force, turn in self.flight.samples:
            at = self.began + t
            if (wait := at - time.monotonic()) > 0:
                time.sleep(wait)
            if self.over:
                return
            time_us = int(1e6 * at + 1e-3 * autopilot_test.OFFSET_NS)
            message = common.MAVLink_highres_imu_message(time_us, *force, *turn, 0, 0, 0, 0, 0, 0, 0, MEASURED_ALL)
            self.socket.sendto(message.pack(self.samples_writer), self.peer)


def spread(points):
    """Root mean square distance from their mean."""
    mean = [sum(axis) / len(points) for axis in zip(*points)]
    return math.sqrt(sum(math.dist(point, mean)**2 for point in points) / len(points))


@unittest.skipUnless(SEQUENCE.is_dir(), "no sequence in $DEEPUAV_SHARED")
class AutopilotImuTest(unittest.TestCase):
    def fly(self, out):
        flight = Flight()
        camera, autopilot = FlightCamera(flight), FlyingAutopilot(flight)
        self.addCleanup(camera.close)
        self.addCleanup(autopilot.close)
        calibration = out.parent / "camera.yaml"
        calibration.write_text(CAMERA_YAML)
        offset = ",".join(f"{v:.6f}" for v in body_of(CAMERA_IN_SENSOR_M))
        live = live_test.Live(camera.address, out, "--camera", calibration, "--clock", "stream", "--save-every", "0",
                              "--set", f"images.working_pixels={WORKING_PIXELS}", "--set",
                              f"system.finish_stopped_s={TIMEOUT_S}", "--mavlink", autopilot.address, "--mavlink-imu",
                              "--mount-offset", offset)
        self.addCleanup(lambda: live.process.poll() is None and live.end(signal.SIGKILL))
        autopilot.wait("COMMAND_LONG", 1)
        time.sleep(RUN_UP_S)
        autopilot.began = camera.begin()
        player = threading.Thread(target=autopilot.play, daemon=True)
        player.start()
        player.join(TIMEOUT_S)
        live.end(signal.SIGINT)
        return flight, autopilot, live

    def test_a_first_flight_has_metres(self):
        with tempfile.TemporaryDirectory(prefix="deepuav-autopilot-imu-test-") as folder:
            flight, autopilot, live = self.fly(Path(folder) / "out")
            log, summary = live.text(), live.summary()
        asked = autopilot.asked()
        self.assertEqual({(message.param2, message.target_system) for message in asked}, {(5000, 1)})
        told = [text for text in autopilot.texts() if "inertial samples" in text]
        self.assertRegex(told[0], r"at \d+ Hz", log)
        # Where the body was on the way back, on the autopilot's clock, as long as no correction moved it.
        at = lambda message: 1e-6 * message.time_usec - 1e-9 * autopilot_test.OFFSET_NS - autopilot.began
        odometry = [message for _, _, message in autopilot.of("ODOMETRY") if at(message) > flight.turn_back]
        self.assertTrue(odometry, log)
        counter = collections.Counter(message.reset_counter for message in odometry).most_common(1)[0][0]
        pairs = [((message.x, -message.y, -message.z), flight.position(at(message))) for message in odometry
                 if message.reset_counter == counter and flight.position(at(message))]
        self.assertGreater(len(pairs), ODOMETRY_WANTED, log)
        found, truth = zip(*pairs)
        speeds_off = [abs(math.hypot(message.vx, message.vy, message.vz) - speed) for message in odometry
                      if message.reset_counter == counter and (speed := flight.speed(at(message))) is not None]
        print(f"{len(odometry)} ODOMETRY, {len(pairs)} of one gauge; spread {spread(found):.4f} m, truth "
              f"{spread(truth):.4f} m; speed off by {statistics.median(speeds_off):.4f} m/s (median); {told}")
        self.assertAlmostEqual(spread(found) / spread(truth), 1, delta=METRES_OFF)
        heights = [[a[2] - b[2] for a, b in pairs]]
        self.assertLess(spread(list(zip(*heights))), METRES_OFF * spread(truth) + HEIGHT_OFF_M, "z is up")
        gauge = max(summary["maps"], key=lambda one: one["keyframes"])["gauge"]
        self.assertEqual(gauge["kind"], "metric", json.dumps(summary["maps"]))


if __name__ == "__main__":
    main(__doc__)
