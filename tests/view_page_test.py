#!/usr/bin/env python3
"""The page of a run that goes on, and of one that was recorded, in Chromium without a screen: nothing on the console, nothing
asked of anyone else, every picture drawn, numbers that move.

  view_page_test.py DEEPUAV [FOLDER_FOR_SCREENSHOTS]

Skipped (exit status 77), which ctest shows as skipped, where Chromium, its driver or Selenium is absent.
"""
import base64
import json
import os
import re
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import layered_scene
import report_page_test as browsing

DEEPUAV = SCREENSHOTS = None
FRAMES = 40
TIMEOUT_S = 120
PHONE, DESK = (412, 860), (1280, 1000)
# From now on the page is given one map in place of all that come, and `drawn` is the scene that it draws.
SHOW_ONE_MAP = """
const bytes = Uint8Array.from(atob(arguments[0]), (letter) => letter.charCodeAt(0)).buffer;
const put = DeepUav.Scene.prototype.put, parse = DeepUav.parseMessage;
DeepUav.Scene.prototype.put = function (name, object) { window.drawn = this; put.call(this, name, object); };
DeepUav.parseMessage = (data) => { const message = parse(data); return message.kind === "map" ? parse(bytes) : message; };
"""
LOOKED_FROM = "return drawn.camera.position.clone().sub(drawn.controls.target).normalize().toArray()"


def metric_map():
    """As view_messages.h says: z is up, a loop ties the first keyframe to the second."""
    header = json.dumps({"kind": "map", "map": 0, "up": [0, 0, 1], "points": 2, "keyframes": 2, "path": 2, "loops": 1,
                         "low": [0, 0, 0], "size": [4, 4, 2]}).encode()
    body = struct.pack("<6H", 0, 0, 0, 65535, 65535, 65535)
    body += struct.pack("<14f", 0, 0, 1, 0, 0, 0, 1, 4, 0, 1, 0, 0, 0, 1)
    body += struct.pack("<6f", 0, 0, 1, 4, 0, 1) + struct.pack("<6f", 0, 0, 1, 4, 0, 1)
    return struct.pack("<I", len(header)) + header + body


class ViewPageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="deepuav-view-page-test-")
        cls.addClassCleanup(cls.folder.cleanup)
        cls.scratch = Path(cls.folder.name)
        cls.scene = layered_scene.euroc(cls.scratch / "scene", FRAMES)
        cls.browser = browsing.open_browser()
        cls.addClassCleanup(cls.browser.quit)

    def setUp(self):
        self.browser.get("about:blank")  # The page of the test before goes on asking for its program.
        for log in ("browser", "performance"):
            self.browser.get_log(log)

    def start(self, *arguments):
        """The address of the page of a program that is under way."""
        log = self.scratch / f"{self.id().rsplit('.', 1)[-1]}.log"
        with log.open("w") as stderr:
            process = subprocess.Popen([DEEPUAV, *map(os.fspath, arguments), "--port", "0"], stderr=stderr,
                                       stdout=subprocess.DEVNULL)
        self.addCleanup(process.wait, TIMEOUT_S)
        self.addCleanup(process.send_signal, signal.SIGINT)
        self.wait(lambda: "watch at " in log.read_text())
        return re.search(r"watch at (http://\S+)", log.read_text())[1]

    def wait(self, condition):
        end = time.monotonic() + TIMEOUT_S
        while not condition():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.1)

    def script(self, source, *arguments):
        return self.browser.execute_script(source, *arguments)

    def counts(self):
        return json.loads(self.script("return document.documentElement.dataset.messages || '{}'"))

    def tile(self, label):
        return self.script("""for (const tile of document.querySelectorAll(".tile"))
            if (tile.querySelector(".label").textContent === arguments[0]) return tile.querySelector(".value span").textContent;
            return null;""", label)

    def shades(self, selector):
        return browsing.ReportPageTest.shades(self, selector)

    def shoot(self, name):
        if SCREENSHOTS:
            self.browser.save_screenshot(f"{SCREENSHOTS}/{name}.png")

    def look(self, colours, size):
        self.browser.set_window_size(*size)
        self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {
            "features": [{"name": "prefers-color-scheme", "value": colours}]})

    def check_clean(self, url):
        console = [entry for entry in self.browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")
                   and "GPU stall" not in entry["message"]]  # SwiftShader, when the canvas is read.
        self.assertEqual(console, [])
        for entry in self.browser.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent" and message["params"]["documentURL"].startswith("http"):
                self.assertTrue(message["params"]["request"]["url"].startswith((url, "data:", "blob:")), message)

    def check_page(self, name):
        self.wait(lambda: self.counts().get("picture", 0) > 5 and self.counts().get("map", 0) > 0)
        self.wait(lambda: self.shades("#scene canvas") > 20)
        self.assertGreater(self.shades("#picture"), 20)
        self.wait(lambda: self.shades("#rate-chart") > 2 and self.shades("#stages-chart") > 2)
        frame, updates = self.tile("Frame"), self.counts()["status"]
        self.wait(lambda: self.tile("Frame") != frame and self.counts()["status"] > updates + 20)
        self.wait(lambda: int(self.tile("Keyframes")) > 2 and int(self.tile("Points")) > 50)
        self.wait(lambda: self.script("return document.getElementById('state').textContent") == "tracked")
        for colours, size in (("dark", DESK), ("light", DESK), ("light", PHONE), ("dark", PHONE)):
            self.look(colours, size)
            time.sleep(0.8)
            page = self.script("return getComputedStyle(document.body).backgroundColor")
            self.assertEqual(sum(map(int, re.findall(r"\d+", page))) > 384, colours == "light")
            # A busy machine lays the page out later.
            self.wait(lambda: self.script("return document.documentElement.scrollWidth <= window.innerWidth"))
            self.shoot(f"{name}-{colours}-{size[0]}")

    def test_live(self):
        out = self.scratch / "live"
        url = self.start("live", self.scene, "--loop", "--out", out, "--view", "--save-every", "0")
        self.look("light", DESK)
        self.browser.get(url)
        self.check_page("live")
        self.assertIn("ms", self.script("return document.getElementById('tiles').textContent"))
        self.assertIn("map 0 starts", self.script("return document.getElementById('events').textContent"))
        self.script("document.getElementById('show-points').click(); document.getElementById('above').click()")
        self.check_clean(url)

    def test_a_recorded_run(self):
        out = self.scratch / "recorded"
        subprocess.run([DEEPUAV, "run", self.scene, "--out", out, "--log-level", "off"], check=True, capture_output=True)
        url = self.start("view", out, "--listen", "0.0.0.0")
        self.look("light", DESK)
        self.browser.get(url)
        self.check_page("recorded")
        self.assertNotIn("token", self.script("return location.href"))
        self.assertIn("the replay begins", self.script("return document.getElementById('events').textContent"))
        self.assertIn("at most", self.script("return document.getElementById('tiles').textContent"))  # Of memory.
        self.check_a_metric_map()
        self.check_clean(url.partition("?")[0])

    def check_a_metric_map(self):
        self.script(SHOW_ONE_MAP, base64.b64encode(metric_map()).decode())
        self.wait(lambda: self.script("return Boolean(window.drawn && drawn.layers.get('loops'))"))
        self.assertEqual(self.script("return drawn.up.toArray()"), [0, 0, 1])
        self.assertEqual(self.script("return Array.from(drawn.layers.get('loops').geometry.attributes.position.array)"),
                         [0, 0, 1, 4, 0, 1])
        self.script("document.getElementById('above').click()")
        self.assertGreater(self.script(LOOKED_FROM)[2], 0.99)
        self.shoot("metric")
        self.script("document.getElementById('show-loops').click()")
        self.assertFalse(self.script("return drawn.layers.get('loops').visible"))

    def test_it_says_that_the_program_ended(self):
        out = self.scratch / "short"
        url = self.start("live", self.scene, "--out", out, "--view", "--save-every", "0")
        self.browser.get(url)
        self.wait(lambda: self.script("return document.getElementById('state').textContent") == "disconnected")


if __name__ == "__main__":
    DEEPUAV = os.path.abspath(sys.argv.pop(1))
    if len(sys.argv) > 1 and not sys.argv[1].startswith("-"):
        SCREENSHOTS = sys.argv.pop(1)
    if absent := browsing.missing():
        print(f"skipped: no {absent}")
        sys.exit(browsing.SKIPPED)
    unittest.main()
