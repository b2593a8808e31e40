#!/usr/bin/env python3
"""`deepuav live --mavlink-gnss`: a camera on the network and an autopilot, made with pymavlink, play a real flight together:
its images, and fixes as GPS_RAW_INT, which end half-way. No map is given, nor inertial samples.

  autopilot_gnss_test.py DEEPUAV      (pymavlink in PYTHONPATH)

Exits with 77, which ctest shows as skipped, where there is no sequence in $DEEPUAV_SHARED.
"""
import math
import random
import signal
import tempfile
import threading
import time
import unittest
from pathlib import Path

from pymavlink.dialects.v20 import common

import autopilot_imu_test
import autopilot_test
import earth
import live_test
from program_under_test import TIMEOUT_S, main

ORIGIN = autopilot_test.ORIGIN  # Of the autopilot's local frame.
FIRST_AT_M = (120.0, -80.0, 15.0)  # Of the sequence's origin, about that: east, north, up.
FIX_EVERY_S, SIGMA_M, LATE_S = 0.2, 0.01, 0.08
ANTENNA_M = (-0.4, 0.1, -0.3)  # Forward, right, down.
RTK_FIXED = 6
GPS_RAW_INT, GPS_GLOBAL_ORIGIN = 24, 49
ODOMETRY_WANTED = 100
# Of a flight within 2 m by fixes to a centimetre, at half the images' size, beside other programs.
OFF_M = 0.12


def path_of(antenna_m):
    """Where the antenna was: seconds from the first image, metres."""
    begin_ns = int(autopilot_imu_test.rows(autopilot_imu_test.SEQUENCE / "mav0/cam0/data.csv")[0][0])
    camera_from_body = autopilot_imu_test.transposed(autopilot_imu_test.BODY_FROM_CAMERA)
    in_camera = tuple(a - b for a, b in zip(
        autopilot_imu_test.times(camera_from_body, antenna_m),
        autopilot_imu_test.times(autopilot_imu_test.transposed(autopilot_imu_test.SENSOR_FROM_CAMERA),
                                 autopilot_imu_test.CAMERA_IN_SENSOR_M)))
    path = []
    for row in autopilot_imu_test.rows(autopilot_imu_test.SEQUENCE / "groundtruth_cam0.csv"):
        values = tuple(map(float, row[1:8]))
        arm = autopilot_imu_test.turned(values[3:], in_camera)
        path.append((1e-9 * (int(row[0]) - begin_ns), tuple(p + a for p, a in zip(values[:3], arm))))
    return path


class FlyingAutopilot(autopilot_test.Autopilot):
    """Plays fixes until the flight turns back, and tells its origin once it was asked."""

    def __init__(self, flight):
        self.flight, self.began = flight, None
        self.fix_writer = common.MAVLink(None, srcSystem=1, srcComponent=autopilot_test.AUTOPILOT)
        super().__init__()

    def asked(self):
        return {int(message.param1): message.param2 for _, _, message in self.of("COMMAND_LONG")
                if message.command == autopilot_imu_test.SET_MESSAGE_INTERVAL}

    def tell(self, message):
        self.socket.sendto(message.pack(self.fix_writer), self.peer)

    def play(self):
        noise, latest = random.Random(3), 0.0
        for t, at in path_of(ANTENNA_M):
            if t < latest + FIX_EVERY_S or self.over:
                continue
            latest = t
            self.tell(common.MAVLink_gps_global_origin_message(*(int(a * b) for a, b in zip(ORIGIN, (1e7, 1e7, 1e3))), 0))
            if (wait := self.began + t + LATE_S - time.monotonic()) > 0:
                time.sleep(wait)
            measured = tuple(a + b + noise.gauss(0, SIGMA_M) for a, b in zip(at, FIRST_AT_M))
            latitude, longitude, altitude = earth.geographic(ORIGIN, measured)
            time_us = int(1e6 * (self.began + t) + 1e-3 * autopilot_test.OFFSET_NS)
            self.tell(common.MAVLink_gps_raw_int_message(
                time_us, RTK_FIXED, round(1e7 * latitude), round(1e7 * longitude), round(1e3 * altitude), 65535, 65535, 65535,
                65535, 20, 0, round(1e3 * SIGMA_M), round(1e3 * SIGMA_M), 0, 0))


@unittest.skipUnless(autopilot_imu_test.SEQUENCE.is_dir(), "no sequence in $DEEPUAV_SHARED")
class AutopilotGnssTest(unittest.TestCase):
    def fly(self, out):
        flight = autopilot_imu_test.Flight()
        camera, autopilot = autopilot_imu_test.FlightCamera(flight), FlyingAutopilot(flight)
        self.addCleanup(camera.close)
        self.addCleanup(autopilot.close)
        calibration = out.parent / "camera.yaml"
        calibration.write_text(autopilot_imu_test.CAMERA_YAML)
        offset = ",".join(f"{v:.6f}" for v in autopilot_imu_test.body_of(autopilot_imu_test.CAMERA_IN_SENSOR_M))
        live = live_test.Live(camera.address, out, "--camera", calibration, "--clock", "stream", "--save-every", "0", "--set",
                              f"images.working_pixels={autopilot_imu_test.WORKING_PIXELS}", "--set",
                              f"system.finish_stopped_s={TIMEOUT_S}", "--mavlink", autopilot.address, "--mavlink-gnss",
                              "--mount-offset", offset, "--mavlink-antenna", ",".join(map(str, ANTENNA_M)))
        self.addCleanup(lambda: live.process.poll() is None and live.end(signal.SIGKILL))
        autopilot.wait("COMMAND_LONG", 2)
        time.sleep(autopilot_imu_test.RUN_UP_S)
        autopilot.began = camera.begin()
        player = threading.Thread(target=autopilot.play, daemon=True)
        player.start()
        player.join(TIMEOUT_S)
        time.sleep(max(0.0, autopilot.began + 2 * flight.turn_back - time.monotonic()))
        live.end(signal.SIGINT)
        return flight, autopilot, live

    def test_a_first_flight_knows_its_place_after_the_last_fix(self):
        with tempfile.TemporaryDirectory(prefix="deepuav-autopilot-gnss-test-") as folder:
            flight, autopilot, live = self.fly(Path(folder) / "out")
            log, summary = live.text(), live.summary()
        asked = autopilot.asked()
        self.assertEqual(asked[GPS_RAW_INT], 200_000)
        self.assertEqual(asked[GPS_GLOBAL_ORIGIN], 5_000_000)
        texts = autopilot.texts()
        self.assertIn("SLAM: position fixes of the autopilot", texts, log)
        self.assertIn("SLAM: position fixes of the autopilot stopped", texts, log)
        self.assertFalse([text for text in texts if "your origin is" in text], "positions are told from the autopilot's own")
        self.assertFalse(autopilot.of("SET_GPS_GLOBAL_ORIGIN"), "which it has already")
        # On the way back nothing but the camera tells where the body is.
        at = lambda message: 1e-6 * message.time_usec - 1e-9 * autopilot_test.OFFSET_NS - autopilot.began
        apart = []
        for _, _, message in autopilot.of("ODOMETRY"):
            truth = flight.position(at(message)) if at(message) > flight.turn_back else None
            if truth:
                told = (message.y, message.x, -message.z)
                apart.append(tuple(a - b - c for a, b, c in zip(told, truth, FIRST_AT_M)))
        self.assertGreater(len(apart), ODOMETRY_WANTED, log)
        rms = math.sqrt(sum(sum(v * v for v in one) for one in apart) / len(apart))
        print(f"{len(apart)} ODOMETRY on the way back, {rms:.3f} m off (rms), nothing aligned")
        self.assertLess(rms, OFF_M, log)
        gauge = max(summary["maps"], key=lambda one: one["keyframes"])["gauge"]
        self.assertEqual(gauge["kind"], "georeferenced", log)


if __name__ == "__main__":
    main(__doc__)
