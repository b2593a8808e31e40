#!/usr/bin/env python3
"""`deepuav live --mavlink` to a receiver made with pymavlink: rate, times, covariances, jumps, clock, heartbeat, and packets of
others.

  autopilot_test.py DEEPUAV      (pymavlink in PYTHONPATH)
"""
import hashlib
import math
import os
import random
import signal
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

from pymavlink.dialects.v20 import common

import layered_scene

DEEPUAV = None
FRAMES = 40
LAP_S = FRAMES / 10
TIMEOUT_S = 120
AUTOPILOT, ESTIMATOR = 1, 197  # Components.
OFFSET_NS = 5 * 10**15  # Of the autopilot's clock.
SCALE_SIGMA = 0.01
ORIGIN = (47.5, 8.25, 430.0)
METRIC, GEOREFERENCED = b"METR", b"GAUG"
# The map's z, along which its first camera looked, counts as up: then the body is level.
LEVEL = ("--mount", "0,90,0")


class Autopilot(threading.Thread):
    """Listens at a port of its own, keeps what comes, answers questions for its clock, and asks for the other's."""

    def __init__(self, answers=True):
        super().__init__(daemon=True)
        self.answers = answers
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.02)
        self.address = f"udp:127.0.0.1:{self.socket.getsockname()[1]}"
        self.reader = common.MAVLink(None)
        self.writer = common.MAVLink(None, srcSystem=1, srcComponent=AUTOPILOT)
        self.received, self.peer, self.over = [], None, False
        self.start()

    def clock_ns(self):
        return time.monotonic_ns() + OFFSET_NS

    def send(self, message):
        if self.peer:
            self.socket.sendto(message.pack(self.writer), self.peer)

    def run(self):
        beat = 0
        while not self.over:
            if time.monotonic() - beat > 0.5:
                beat = time.monotonic()
                self.send(common.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3))
                if self.answers:
                    self.send(common.MAVLink_timesync_message(0, self.clock_ns()))
            try:
                datagram, self.peer = self.socket.recvfrom(4096)
            except OSError:
                continue
            arrived, clock_ns = time.monotonic(), self.clock_ns()
            for message in self.reader.parse_buffer(datagram) or []:
                self.received.append((arrived, clock_ns, message))
                if message.get_type() == "TIMESYNC" and message.tc1 == 0 and self.answers:
                    self.send(common.MAVLink_timesync_message(clock_ns, message.ts1))

    def of(self, kind):
        return [one for one in list(self.received) if one[2].get_type() == kind]

    def texts(self):
        return [message.text for _, _, message in self.of("STATUSTEXT")]

    def wait(self, kind, count, seconds=TIMEOUT_S):
        end = time.monotonic() + seconds
        while len(found := self.of(kind)) < count:
            if time.monotonic() > end:
                raise AssertionError(f"only {len(found)} of {count} {kind}; texts: {self.texts()}")
            time.sleep(0.05)
        return found

    def close(self):
        self.over = True
        self.join()
        self.socket.close()


def with_gauge(source, target, kind):
    """The map of an earlier run as if other sensors had told what its world means: docs/map-format.md."""
    raw, at = source.read_bytes(), 12
    while raw[at:at + 4] not in (b"TURN", b"END "):
        at += 24 + struct.unpack_from("<Q", raw, at + 16)[0] + 32
    content = struct.pack("<Qq", 1, 0) + (struct.pack("<3d", *ORIGIN) if kind == GEOREFERENCED else b"")
    content += struct.pack("<d", SCALE_SIGMA)
    section = kind + struct.pack("<IQQ", 0, len(content), len(content)) + content
    target.write_bytes(raw[:at] + section + hashlib.sha256(section).digest() + raw[at:])
    return target


def uncounted_jumps(odometry, tolerance_m):
    """How often the place changed by more than the velocity explains while the counter stayed; and how often that rose."""
    jumps = counted = 0
    for (_, _, a), (_, _, b) in zip(odometry, odometry[1:]):
        if a.reset_counter != b.reset_counter:
            counted += (b.reset_counter - a.reset_counter) % 256
            continue
        seconds = 1e-6 * (b.time_usec - a.time_usec)
        speed = max(math.hypot(m.vx, m.vy, m.vz) for m in (a, b))
        jumps += math.dist((a.x, a.y, a.z), (b.x, b.y, b.z)) > speed * seconds + tolerance_m
    return jumps, counted


class AutopilotTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="deepuav-autopilot-test-")
        cls.addClassCleanup(cls.folder.cleanup)
        cls.scratch = Path(cls.folder.name)
        os.environ["XDG_CACHE_HOME"] = str(cls.scratch / "cache")
        cls.scene = layered_scene.euroc(cls.scratch / "scene", FRAMES)
        subprocess.run([DEEPUAV, "run", cls.scene, "--out", cls.scratch / "first", "--log-level", "off"], check=True,
                       capture_output=True)
        free = cls.scratch / "first/map.deepuav"
        cls.metric = with_gauge(free, cls.scratch / "metric.deepuav", METRIC)
        cls.georeferenced = with_gauge(free, cls.scratch / "georeferenced.deepuav", GEOREFERENCED)

    def start(self, autopilot, *arguments):
        out = Path(tempfile.mkdtemp(prefix="out-", dir=self.scratch))
        self.log = out.with_suffix(".log")
        with self.log.open("w") as log:
            process = subprocess.Popen([DEEPUAV, "live", self.scene, "--out", out, "--save-every", "0", "--mavlink",
                                        autopilot.address, *map(os.fspath, arguments)], stdout=subprocess.DEVNULL, stderr=log)

        def stop():
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            process.wait(TIMEOUT_S)

        self.addCleanup(stop)
        self.stop = stop
        return process

    def autopilot(self, **options):
        autopilot = Autopilot(**options)
        self.addCleanup(autopilot.close)
        return autopilot

    def check_stream(self, odometry):
        times = [message.time_usec for _, _, message in odometry]
        self.assertTrue(all(a < b for a, b in zip(times, times[1:])), "times grow")
        for _, _, message in odometry:
            self.assertEqual((message.frame_id, message.child_frame_id), (20, 12))
            self.assertAlmostEqual(math.hypot(*message.q), 1, places=5)
            self.assertTrue(1 <= message.quality <= 100)
            for covariance in (message.pose_covariance, message.velocity_covariance):
                self.assertTrue(all(map(math.isfinite, covariance)))
                self.assertTrue(all(covariance[i] > 0 for i in (0, 6, 11, 15, 18, 20)))

    def test_odometry_in_a_metric_map(self):
        autopilot = self.autopilot()
        self.start(autopilot, "--map", self.metric, "--loop", "--localise-only", *LEVEL)
        autopilot.wait("ODOMETRY", 10)
        began = time.monotonic()
        time.sleep(3 * LAP_S)
        self.stop()
        ended = time.monotonic()
        all_odometry = autopilot.of("ODOMETRY")
        odometry = [one for one in all_odometry if one[0] >= began]
        self.check_stream(all_odometry)
        jumps, counted = uncounted_jumps(odometry, tolerance_m=0.1)
        self.assertEqual(jumps, 0)
        self.assertGreaterEqual(counted, 2, "the scene begins anew after each lap")
        # Where the camera is found at once the stream has no gaps.
        rate = (len(odometry) - 1) / (odometry[-1][0] - odometry[0][0])
        self.assertTrue(30 <= rate <= 50, rate)
        # Times are the autopilot's, of the moment.
        for _, clock_ns, message in odometry:
            self.assertAlmostEqual(1e-3 * clock_ns, message.time_usec, delta=0.25e6)
        heartbeats = [message for arrived, _, message in autopilot.of("HEARTBEAT") if arrived >= began]
        self.assertAlmostEqual(len(heartbeats), ended - began, delta=3)
        self.assertEqual({(message.type, message.get_srcComponent()) for message in heartbeats}, {(18, ESTIMATOR)})
        answers = [(clock_ns, message) for _, clock_ns, message in autopilot.of("TIMESYNC") if message.tc1 != 0]
        self.assertGreater(len(answers), 5)
        clock_ns, last = answers[-1]
        self.assertAlmostEqual(last.tc1, clock_ns, delta=2.5e8)
        self.assertLess(last.ts1, clock_ns)
        self.assertFalse(autopilot.of("SET_GPS_GLOBAL_ORIGIN"))
        self.assertFalse(autopilot.of("VISION_POSITION_ESTIMATE"))
        self.assertIn("SLAM: sends odometry", autopilot.texts())

    def test_it_moves_as_the_camera(self):
        autopilot = self.autopilot()
        process = self.start(autopilot, "--map", self.metric, "--localise-only", "--mount", "0,0,0")
        process.wait(TIMEOUT_S)
        odometry = [message for _, _, message in autopilot.of("ODOMETRY")]
        self.assertGreater(len(odometry), 5, self.log.read_text())
        # To the right and down by a fifth of it, always at one speed; the map's first camera looks along z: up, as it were.
        # In the mean: the scene is drawn on whole pixels, so that single steps point elsewhere.
        last = odometry[-1]
        vx, vy, vz = (statistics.mean(getattr(message, axis) for message in odometry) for axis in ("vx", "vy", "vz"))
        self.assertAlmostEqual(vz / vy, 0.2, delta=0.1)
        self.assertLess(abs(vx), 0.2 * vy)
        moved = [b - a for a, b in zip((odometry[0].x, odometry[0].y, odometry[0].z), (last.x, last.y, last.z))]
        seconds = 1e-6 * (last.time_usec - odometry[0].time_usec)
        self.assertAlmostEqual(math.hypot(*moved) / seconds / math.hypot(vx, vy, vz), 1, delta=0.2)
        # x right and y down in the world of the map: x and -y of the local frame.
        self.assertGreater(moved[0], 0)
        self.assertAlmostEqual(moved[1] / moved[0], -0.2, delta=0.1)

    def test_vision_position_and_origin(self):
        autopilot = self.autopilot()
        self.start(autopilot, "--map", self.georeferenced, "--loop", "--localise-only", "--mavlink-vision",
                   "--mavlink-system", "7", "--mount-offset", "0.1,0,0.05", *LEVEL)
        estimates = autopilot.wait("VISION_POSITION_ESTIMATE", 40)
        self.assertEqual({message.get_srcSystem() for _, _, message in estimates}, {7})
        self.assertTrue(all(map(math.isfinite, estimates[-1][2].covariance)))
        self.assertFalse(autopilot.of("ODOMETRY"))
        origin = autopilot.wait("SET_GPS_GLOBAL_ORIGIN", 1)[0][2]
        self.assertEqual((origin.latitude, origin.longitude, origin.altitude),
                         tuple(round(value * factor) for value, factor in zip(ORIGIN, (1e7, 1e7, 1e3))))

    def test_without_scale_it_refuses(self):
        autopilot = self.autopilot(answers=False)
        self.start(autopilot, "--loop")
        text = autopilot.wait("STATUSTEXT", 1)
        end = time.monotonic() + TIMEOUT_S
        while not any("no scale" in one for one in autopilot.texts()):
            self.assertLess(time.monotonic(), end, text)
            time.sleep(0.1)
        time.sleep(3)
        self.stop()
        self.assertFalse(autopilot.of("ODOMETRY"))
        self.assertGreater(len(autopilot.of("HEARTBEAT")), 3)
        self.assertEqual(self.log.read_text().count("no scale"), 1)

    def test_hostile_packets(self):
        autopilot = self.autopilot()
        self.start(autopilot, "--map", self.metric, "--loop", "--localise-only", *LEVEL)
        autopilot.wait("ODOMETRY", 10)
        generator = random.Random(1)
        stranger = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(stranger.close)
        good = common.MAVLink_timesync_message(5, 77).pack(autopilot.writer)
        began, asked = time.monotonic(), 0
        while time.monotonic() - began < 2 * LAP_S:
            for _ in range(20):
                broken = bytearray(good * generator.randrange(1, 40))
                for _ in range(generator.randrange(1, 30)):
                    broken[generator.randrange(len(broken))] = generator.randrange(256)
                autopilot.socket.sendto(bytes(broken[:1400]), autopilot.peer)
                autopilot.socket.sendto(generator.randbytes(generator.randrange(1400)), autopilot.peer)
                # A lie about the clock, from another address.
                stranger.sendto(common.MAVLink_timesync_message(0, 666).pack(autopilot.writer), autopilot.peer)
                asked += 1
            time.sleep(0.01)
        self.stop()
        odometry = [one for one in autopilot.of("ODOMETRY") if one[0] >= began]
        self.check_stream(odometry)
        self.assertEqual(uncounted_jumps(odometry, tolerance_m=0.1)[0], 0)
        self.assertGreater((len(odometry) - 1) / (odometry[-1][0] - odometry[0][0]), 25)
        self.assertGreater(asked, 500)
        self.assertNotIn(666, {message.ts1 for _, _, message in autopilot.of("TIMESYNC")})
        stranger.settimeout(0.1)
        with self.assertRaises(OSError):
            stranger.recv(100)

    def test_misuse(self):
        for arguments, told in ((("--mavlink", "udp:nowhere"), "udp:HOST:PORT"), (("--mavlink", "tcp:127.0.0.1:1"), "udp:HOST:PORT"),
                                (("--mavlink", "udp:no.such.host.invalid:14540"), "no.such.host.invalid"),
                                (("--mavlink", "udp:127.0.0.1:1", "--mount", "sideways"), "sideways"),
                                (("--mavlink", "udp:127.0.0.1:1", "--speed", "2"), "--speed"),
                                (("--mount", "down"), "--mavlink"), (("--mavlink-vision",), "--mavlink"),
                                (("--mavlink-imu",), "--mavlink"), (("--mavlink-gnss",), "--mavlink"),
                                (("--mavlink", "udp:127.0.0.1:1", "--mavlink-antenna", "0,0,0"), "--mavlink-gnss"),
                                (("--mavlink", "udp:127.0.0.1:1", "--mavlink-gnss", "--mavlink-antenna", "up"), "up")):
            done = subprocess.run([DEEPUAV, "live", self.scene, "--out", self.scratch / "misuse", *arguments],
                                  capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
            self.assertIn(done.returncode, (1, 2), arguments)
            self.assertIn(told, done.stderr)
            self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)


if __name__ == "__main__":
    DEEPUAV = os.path.abspath(sys.argv.pop(1))
    unittest.main()
