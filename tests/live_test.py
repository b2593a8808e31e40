#!/usr/bin/env python3
"""`deepuav live` on files, datasets and a camera on the network that drops, freezes and changes its size.

  live_test.py DEEPUAV

Where $DEEPUAV_FAKE_CAMERA names the library that stands for one (support/fake_camera.cc), on a camera of the machine, too.
"""
import http.server
import json
import os
import random
import signal
import subprocess
import tempfile
import threading
import time
import unittest
from pathlib import Path

import command_test_data as data
import layered_scene
from jpeg_encoder import jpeg
from program_under_test import TIMEOUT_S, UnderWay, command, main
from scene_test_case import FRAMES, SceneTest

RATE_HZ = 10
BOUNDARY = b"--frame\r\n"


def camera_yaml(width=layered_scene.WIDTH, height=layered_scene.HEIGHT):
    scale = width / layered_scene.WIDTH
    focal = layered_scene.FOCAL_PX * scale
    return (f"model: pinhole\nwidth: {width}\nheight: {height}\nfx: {focal}\nfy: {focal}\n"
            f"cx: {(width - 1) / 2}\ncy: {(height - 1) / 2}\nrate_hz: {RATE_HZ}\n")


def doubled(rows):
    """At twice the size."""
    wide = [bytes(value for value in row for _ in range(2)) for row in rows]
    return [row for row in wide for _ in range(2)]


class Camera:
    """A camera on the network: Motion JPEG over HTTP. `show` sets what it sends from then on, whoever asks."""

    def __init__(self):
        self.images, self.refuses, self.sent = [], False, 0
        camera = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                camera.serve(self)

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        self.address = f"http://127.0.0.1:{self.server.server_port}/video"

    def close(self):
        self.show([], refuses=True)
        self.server.shutdown()
        self.server.server_close()

    def show(self, images, refuses=False):
        self.refuses, self.images, self.sent = refuses, images, 0

    def wait(self, count):
        """Until so many images of what it shows were sent."""
        end = time.monotonic() + TIMEOUT_S
        while self.sent < count:
            if time.monotonic() > end:
                raise AssertionError(f"only {self.sent} of {count} images were asked for")
            time.sleep(0.02)

    def serve(self, request):
        if self.refuses:
            return request.send_error(503)
        request.send_response(200)
        request.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
        request.end_headers()
        try:
            while not self.refuses:
                images = self.images
                if images:
                    image = images[self.sent % len(images)]
                    request.wfile.write(BOUNDARY + b"Content-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(image) +
                                        image + b"\r\n")
                    self.sent += 1
                time.sleep(1 / RATE_HZ)
        except OSError:
            pass  # Nobody looks any more.


class Live(UnderWay):
    """`deepuav live` under way."""

    def __init__(self, source, out, *arguments, log_level="info", **options):
        self.out = out
        super().__init__(f"{out}.log", "live", source, "--out", out, "--log-level", log_level, *arguments,
                         stdout=subprocess.PIPE, text=True, **options)

    def end(self, by=None):
        """Its exit status and what it printed."""
        if by:
            self.process.send_signal(by)
        printed, _ = self.process.communicate(timeout=TIMEOUT_S)
        return self.process.returncode, printed

    def summary(self):
        return json.loads((self.out / "summary.json").read_text())


class LiveTest(SceneTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cards = layered_scene.make_cards(random.Random(1))
        cls.pictures = [layered_scene.draw(cards, i * layered_scene.STEP_M, 0.2 * i * layered_scene.STEP_M)
                        for i in range(FRAMES)]
        cls.jpegs = [jpeg(rows) for rows in cls.pictures]
        cls.calibration = cls.scratch / "camera.yaml"
        cls.calibration.write_text(camera_yaml())

    def setUp(self):
        self.out = Path(tempfile.mkdtemp(prefix="out-", dir=self.scratch)) / "run"

    def live(self, source, *arguments, **options):
        live = Live(source, self.out, *arguments, **options)
        self.addCleanup(lambda: live.process.poll() is None and live.process.kill())
        return live

    def poses(self):
        return [line for line in (self.out / "trajectory.txt").read_text().splitlines() if not line.startswith("#")]

    def check_run(self, live, least_poses=FRAMES // 2):
        summary = live.summary()
        self.assertEqual((summary["schedule"], len(summary["maps"])), ("live", 1))
        self.assertGreaterEqual(len(self.poses()), least_poses)
        return summary

    def test_a_dataset_at_its_own_pace(self):
        live = self.live(self.scene)
        status, printed = live.end()
        self.assertEqual(status, 0, live.text())
        summary = self.check_run(live)
        frames = summary["frames"]
        self.assertLessEqual(frames["images"], FRAMES)
        self.assertEqual(frames["images"], frames["processed"] + frames["skipped_late"])
        self.assertGreater(summary["wall_s"], 0.9 * (FRAMES - 1) / RATE_HZ)
        self.assertEqual(summary["live"]["arrived"], frames["images"])
        self.assertGreater(summary["live"]["p95_latency_ms"], 0)
        self.assertIn("after the image", printed)
        self.assertTrue(self.poses()[0].startswith("1."), "times are the dataset's")

    def test_a_video_by_the_time_of_arrival(self):
        video = self.scratch / "flight.avi"
        video.write_bytes(data.mjpeg_avi(self.jpegs, RATE_HZ, layered_scene.WIDTH, layered_scene.HEIGHT))
        live = self.live(video, "--camera", self.calibration, "--clock", "arrival")
        self.assertEqual(live.end()[0], 0, live.text())
        self.check_run(live)
        self.assertAlmostEqual(float(self.poses()[0].split()[0]), time.time(), delta=TIMEOUT_S)

    def test_what_there_is_is_saved_meanwhile_and_at_a_signal(self):
        for name, status in (("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)):
            with self.subTest(name):
                self.out = Path(tempfile.mkdtemp(prefix="out-", dir=self.scratch)) / "run"
                live = self.live(self.scene, "--loop", "--save-every", "0.5", log_level="debug")
                live.wait_for(r"saved \d\d+ frames")
                summary = self.check_run(live, least_poses=1)
                self.assertFalse(summary["stopped_early"])
                subprocess.run(command("map", "info", self.out / "map.deepuav"), check=True, capture_output=True)
                self.assertEqual(live.end(getattr(signal, name))[0], status)
                self.assertTrue(self.check_run(live, least_poses=1)["stopped_early"])
                self.assertGreater(live.summary()["frames"]["processed"], summary["frames"]["processed"])

    def test_a_camera_on_the_network_that_fails(self):
        camera = Camera()
        self.addCleanup(camera.close)
        camera.show(self.jpegs)
        live = self.live(camera.address, "--camera", self.calibration, "--timeout", "1")
        live.wait_for("map 0 starts")
        camera.show([], refuses=True)  # The link drops, and the camera is away for a while.
        live.wait_for("the link dropped: opening it again")
        time.sleep(1)
        camera.show(self.jpegs)
        live.wait_for(r"the link is open again after \d")
        camera.show(self.jpegs[:1])
        live.wait_for("the picture is frozen")
        camera.show(self.jpegs)
        live.wait_for("the picture moves again")
        camera.show([])  # Nothing comes, but the link holds.
        live.wait_for("(?s)(the link dropped.*){2}")
        camera.show([jpeg(doubled(rows)) for rows in self.pictures[:10]])
        live.wait_for("(?s)(the link is open again.*){2}")
        live.wait_for("640x480 now: scaled to 320x240")
        camera.show([jpeg(rows[:160]) for rows in self.pictures[:10]])
        live.wait_for("320x160 now: left out")
        camera.show(self.jpegs)
        live.wait_for("320x240 now: as calibrated")
        camera.wait(2 * FRAMES)
        self.assertEqual(live.end(signal.SIGINT)[0], 130)
        told = self.check_run(live)["live"]
        self.assertGreaterEqual(told["reconnects"], 2)
        self.assertGreater(told["frozen"], 0)
        self.assertGreater(told["misfits"], 0)
        self.assertLess(live.text().count("frozen"), 4, "a line for what happens, not for every image")

    @unittest.skipUnless(os.environ.get("DEEPUAV_FAKE_CAMERA"), "no camera")
    def test_a_camera_that_is_unplugged(self):
        images = Path(tempfile.mkdtemp(prefix="images-", dir=self.scratch))
        for i, image in enumerate(self.jpegs):
            (images / f"{i:03}.jpg").write_bytes(image)
        device = "/dev/video42"
        camera = {"LD_PRELOAD": os.environ["DEEPUAV_FAKE_CAMERA"], "FAKE_CAMERA_DEVICE": device, "FAKE_CAMERA_HZ": str(RATE_HZ),
                  "FAKE_CAMERA_IMAGES": str(images), "FAKE_CAMERA_SIZE": f"{layered_scene.WIDTH}x{layered_scene.HEIGHT}"}
        live = self.live(device, "--camera", self.calibration, "--timeout", "1", env=os.environ | camera)
        live.wait_for("map 0 starts")
        (images / "gone").touch()
        live.wait_for("the link dropped: opening it again")
        (images / "gone").unlink()
        live.wait_for(r"the link is open again after \d")
        time.sleep(2)
        began = time.monotonic()
        (images / "stalled").touch()
        live.wait_for("(?s)the link dropped.*the link dropped")
        self.assertLess(time.monotonic() - began, 5, "--timeout, not the ten seconds of who reads the camera")
        (images / "stalled").unlink()
        live.wait_for(r"(?s)open again after.*open again after \d")
        time.sleep(2)
        self.assertEqual(live.end(signal.SIGINT)[0], 130)
        summary = self.check_run(live, least_poses=2 * RATE_HZ)
        self.assertGreaterEqual(summary["live"]["reconnects"], 2)
        times = [float(pose.split()[0]) for pose in self.poses()]
        self.assertTrue(all(b > a for a, b in zip(times, times[1:])))
        self.assertAlmostEqual(times[-1], time.time(), delta=TIMEOUT_S)

    def test_without_a_calibration_the_lens_is_looked_for_first(self):
        camera = Camera()
        self.addCleanup(camera.close)
        camera.show(self.jpegs)
        live = self.live(camera.address, "--learn-lens", "8")
        live.wait_for(r"the lens is looked for in 2\d images; tracking begins then")
        # Cards before a camera that never turns look the same under any focal length.
        live.wait_for("the images do not tell the lens: it stays as it was|focal length found")
        self.assertNotIn("map 0 starts", live.text())
        live.wait_for("map 0 starts")
        camera.wait(len(self.jpegs))
        self.assertEqual(live.end(signal.SIGINT)[0], 130)
        self.check_run(live, least_poses=1)

    def test_what_stands_still_tells_no_lens(self):
        camera = Camera()
        self.addCleanup(camera.close)
        camera.show(self.jpegs[:1])
        live = self.live(camera.address, "--learn-lens", "3")
        live.wait_for(r"\d images that moved in 3 s, at least 20 tell a lens: it is guessed")
        camera.show(self.jpegs)
        live.wait_for("map 0 starts")
        self.assertEqual(live.end(signal.SIGINT)[0], 130)

    def test_memory_stays_over_many_loops(self):
        live = self.live(self.scene, "--loop", "--speed", "20", "--save-every", "2", "--set", "system.max_records=200",
                         log_level="debug")
        live.wait_for(r"(?s)(saved \d.*){4}")
        before = live.resident_mb()
        live.wait_for(r"(?s)(saved \d.*){12}")
        self.assertLess(live.resident_mb(), 1.15 * before)
        self.assertEqual(live.end(signal.SIGINT)[0], 130)
        frames = self.check_run(live)["frames"]
        self.assertLessEqual(frames["processed"], 201)
        self.assertGreater(frames["forgotten"], 100)

    def test_what_cannot_be_opened_is_told_in_a_line_without_secrets(self):
        for source, told in (("http://ann:secret@127.0.0.1:1/video?key=secret", "127.0.0.1:1/video"),
                             ("/dev/video77", "/dev/video77"), (self.scratch / "nothing.mp4", "nothing.mp4")):
            live = self.live(source, "--timeout", "2")
            self.assertEqual(live.end()[0], 1)
            self.assertIn(told, live.text())
            self.assertNotIn("secret", live.text())
            self.assertEqual(len(live.text().splitlines()), 1, live.text())

    def test_misuse(self):
        for arguments, told in ((("rtsp://127.0.0.1:1/x", "--loop"), "--loop"), ((self.scene, "--speed", "0"), "--speed"),
                                ((self.scene, "--clock", "moon"), "--clock"), ((self.scene, "--save-every", "-1"), "--save-every")):
            live = self.live(*arguments)
            self.assertEqual(live.end()[0], 2)
            self.assertIn(told, live.text())


if __name__ == "__main__":
    main(__doc__)
