#!/usr/bin/env python3
"""The report's page as a browser shows it: it loads from a file without console errors or any request, holds what it
should, and draws its three-dimensional view and its charts.

  report_page_test.py DEEPUAV [SCREENSHOT_FOLDER]

Makes the output folder of a run itself. Exits with 77, which ctest shows as skipped, where Chromium, its driver or
Selenium is absent.
"""
import json
import math
import os
import random
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

SKIPPED = 77
POSES, RATE_HZ, FIRST_S, SCALE, NOISE_M = 240, 20, 1_000_000, 0.2, 0.03
LOAD_SECONDS = 120

DEEPUAV = None
SCREENSHOTS = None
scratch = tempfile.TemporaryDirectory(prefix="deepuav-report-test-")
SCRATCH = Path(scratch.name)


def flight(i):
    t = i / RATE_HZ
    return 6 * math.sin(0.5 * t), 4 * math.sin(0.8 * t + 1), 2 + 0.5 * math.sin(1.3 * t)


def write_trajectory(file, poses):
    lines = [f"{FIRST_S + i / RATE_HZ:.9f} {x:.9f} {y:.9f} {z:.9f} 0 0 0 1" for i, (x, y, z) in poses]
    file.write_text("\n".join(lines) + "\n")


def write_run(out, seed):
    """An output folder as `deepuav run` leaves it, but for the map."""
    out.mkdir(parents=True)
    generator = random.Random(seed)
    noisy = [(i, tuple(SCALE * (value + generator.gauss(0, NOISE_M)) for value in flight(i))) for i in range(POSES)
             if not 100 <= i < 130]
    write_trajectory(out / "trajectory.txt", noisy)
    write_trajectory(out / "keyframes.txt", noisy[::15])
    points = [[SCALE * generator.uniform(-10, 10) for _ in range(2)] + [0.02 * generator.gauss(0, 1)]
              for _ in range(3000)]
    header = ("ply\nformat binary_little_endian 1.0\nelement vertex 3000\nproperty float x\nproperty float y\n"
              "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n")
    (out / "points.ply").write_bytes(header.encode() + b"".join(struct.pack("<3f3B", *p, 180, 180, 180) for p in points))
    rows = [f"track,{i},{5 + generator.random():.4f}" for i in range(POSES)]
    frames = [f'{i},{i},lost,,100,0,,"too dark, or ""blurred"""' if 100 <= i < 130 else f"{i},{i},tracked,0,500,90,,"
              for i in range(POSES)]
    (out / "frames.csv").write_text("frame,time_ns,state,map,key_points,landmarks,keyframe,reason\n" +
                                    "\n".join(frames) + "\n")
    (out / "timings.csv").write_text("stage,call,milliseconds\n" + "\n".join(rows) + "\n")
    (out / "summary.json").write_text(json.dumps({
        "version": "0", "dataset": {"path": "/nowhere/<b>flight</b>", "kind": "euroc"}, "schedule": "threaded",
        "frames": {"processed": POSES, "located": len(noisy), "tracked_online": 200, "lost": 30}, "main_map": 0,
        "maps": [{"id": 0, "keyframes": 14, "landmarks": 3000, "frames": len(noisy)}], "wall_s": 12.5,
        "peak_resident_mb": 200.0,
        "stages": {"track": {"count": POSES, "median_ms": 5.5, "p95_ms": 6.0, "total_s": 1.3}},
        "options": {"features.keypoints": str(500 + seed), "features.border": "4"}}))
    return out


def open_browser():
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service

    options = Options()
    options.binary_location = shutil.which("chromium")
    for argument in ("--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
                     "--enable-unsafe-swiftshader", "--disable-dev-shm-usage", "--disable-background-networking",
                     "--disable-component-update", "--no-first-run", f"--user-data-dir={SCRATCH}/browser",
                     "--window-size=900,700"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    browser = webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)
    browser.set_page_load_timeout(LOAD_SECONDS)
    browser.set_script_timeout(LOAD_SECONDS)
    return browser


class ReportPageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.truth = SCRATCH / "truth.txt"
        write_trajectory(cls.truth, [(i, flight(i)) for i in range(POSES + 60)])  # Flown on after the run.
        cls.runs = [write_run(SCRATCH / name, seed) for name, seed in (("first", 1), ("second", 2))]
        cls.browser = open_browser()
        cls.addClassCleanup(cls.browser.quit)

    def write_page(self, *arguments):
        page = SCRATCH / f"{self.id().rsplit('.', 1)[-1]}.html"
        subprocess.run([DEEPUAV, "report", *map(os.fspath, arguments), "--html", page], check=True,
                       stdout=subprocess.DEVNULL)
        return page

    def load(self, page):
        """Opens the page and waits for it; console and network must stay silent."""
        for log in ("browser", "performance"):
            self.browser.get_log(log)
        self.browser.get(page.as_uri())
        end = time.monotonic() + LOAD_SECONDS
        while self.script("return document.documentElement.dataset.ready") != "yes":
            self.assertLess(time.monotonic(), end, self.browser.get_log("browser"))
            time.sleep(0.2)
        if SCREENSHOTS:
            self.browser.save_screenshot(f"{SCREENSHOTS}/{page.stem}.png")
        console = [entry for entry in self.browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")
                   and "GPU stall" not in entry["message"]]  # SwiftShader, when the canvas is read.
        self.assertEqual(console, [])
        requests = []
        for entry in self.browser.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent" and message["params"]["documentURL"] == page.as_uri():
                requests.append(message["params"]["request"]["url"])
        fetched = [url for url in requests if not url.startswith(("data:", "blob:"))]
        self.assertEqual(fetched, [page.as_uri()])

    def script(self, source, *arguments):
        return self.browser.execute_script(source, *arguments)

    def texts(self, selector):
        return self.script("return [...document.querySelectorAll(arguments[0])].map((e) => e.textContent)", selector)

    def shades(self, selector):
        """How many different colours a canvas shows, sampled."""
        return self.script("""
            const canvas = document.querySelector(arguments[0]), copy = document.createElement("canvas");
            copy.width = 200; copy.height = 150;
            const context = copy.getContext("2d");
            context.drawImage(canvas, 0, 0, 200, 150);
            const data = context.getImageData(0, 0, 200, 150).data, seen = new Set();
            for (let i = 0; i < data.length; i += 4) seen.add(data.slice(i, i + 4).join());
            return seen.size;""", selector)

    def test_one_run(self):
        self.load(self.write_page(self.runs[0], "--truth", self.truth))
        self.check_figures()
        tiles = " ".join(self.texts("#summary-tiles .tile"))
        self.assertIn("Absolute error (ATE)", tiles)
        self.assertIn("210 of 240", tiles)
        self.assertIn("<b>flight</b>", self.texts("#options-table")[0])
        for selector, least in (("#scene canvas", 30), ("#plan", 10), ("#components canvas", 5),
                                ("#error-charts canvas", 5), ("#error-distribution", 5), ("#timing-chart", 5)):
            self.assertGreater(self.shades(selector), least, selector)
        hidden = self.script("return [...document.querySelectorAll('main section[hidden]')].map((e) => e.id)")
        self.assertEqual(hidden, ["map", "survey", "pictures"])  # All need the map's file.
        self.assertEqual(len(self.texts("#contents a")), 5)
        self.check_pointer()

    def check_figures(self):
        """They are those of `deepuav eval`."""
        figures = json.loads(subprocess.run(
            [DEEPUAV, "eval", self.truth, self.runs[0] / "trajectory.txt", "--json", "-"], check=True,
            capture_output=True, text=True).stdout)
        first_row = self.script(
            "return [...document.querySelectorAll('#error-table tbody tr:first-child td')].map((e) => e.textContent)")
        for text, name in zip(first_row[1:], ("rmse", "mean", "median", "std", "min", "max")):
            self.assertAlmostEqual(float(text), figures["ate_m"][name], delta=1e-3 * figures["ate_m"]["rmse"])
        self.assertLess(figures["compared_path_m"], 0.9 * figures["truth_path_m"])
        share = re.search(r"rmse; ([\d.]+) % of ([\d.]+) m flown", " ".join(self.texts("#summary-tiles .tile")))
        self.assertAlmostEqual(float(share[2]), figures["compared_path_m"], delta=1e-2 * figures["compared_path_m"])
        self.assertAlmostEqual(float(share[1]), 100 * figures["ate_m"]["rmse"] / figures["compared_path_m"], delta=0.01)

    def check_pointer(self):
        self.script("""
            const chart = document.querySelector("#components .chart"), box = chart.getBoundingClientRect();
            chart.dispatchEvent(new PointerEvent("pointermove", {clientX: box.left + box.width / 2, bubbles: true}));""")
        cursors = self.script("return [...document.querySelectorAll('.cursor')].filter((e) => !e.hidden).length")
        self.assertEqual(cursors, self.script("return document.querySelectorAll('.cursor').length"))
        self.assertFalse(self.script("return document.getElementById('plan-dot').hidden"))
        self.assertIn("at ", self.texts("#components .readout")[0])

    def test_several_runs_are_compared_and_can_be_hidden(self):
        self.load(self.write_page(*self.runs, "--truth", self.truth))
        self.assertEqual(self.texts("#runs .chip"), ["first", "second"])
        self.assertEqual(self.texts("#summary-table thead th"), ["", "first", "second"])
        self.assertEqual(len(self.texts("#options-table tr.differs")), 1)
        before = self.script("return document.querySelector('#components canvas').toDataURL()")
        self.script("document.querySelectorAll('#runs .chip')[1].click()")
        self.assertEqual(self.script("return document.querySelectorAll('.chip[aria-pressed=false]').length"), 1)
        self.assertNotEqual(self.script("return document.querySelector('#components canvas').toDataURL()"), before)

    def test_lost_frames_and_their_reasons_are_told(self):
        self.load(self.write_page(self.runs[0]))
        self.assertEqual(self.texts("#summary-lost td"), ["too dark, or blurred", "30", "100 to 129"])

    def test_a_run_without_a_map_draws_nothing_empty(self):
        out = write_run(SCRATCH / "without-map", 3)
        for name in ("trajectory.txt", "keyframes.txt"):
            (out / name).write_text("")
        (out / "points.ply").unlink()
        summary = json.loads((out / "summary.json").read_text())
        summary.update(main_map=-1, maps=[])
        (out / "summary.json").write_text(json.dumps(summary))
        self.load(self.write_page(out))
        self.assertIn("no map was started", " ".join(self.texts("#summary-tiles .tile")))
        self.assertTrue(self.script("return document.getElementById('trajectory').hidden"))

    def test_up_is_not_taken_for_the_heading_of_a_survey(self):
        """Looking straight down with the image's top to the east, on lines east and west: up is the least reach."""
        out = write_run(SCRATCH / "survey", 4)
        lines = []
        for i in range(POSES):
            x, y, z = 40 * math.sin(i / 20), 30 * i / POSES, 20 + 0.1 * math.sin(i)
            # Columns of the rotation: the image's right is south, its down west, the optical axis down.
            lines.append(f"{FIRST_S + i / RATE_HZ:.9f} {x} {y} {z} {-math.sqrt(0.5)} {math.sqrt(0.5)} 0 0")
        for name in ("trajectory.txt", "keyframes.txt"):
            (out / name).write_text("\n".join(lines) + "\n")
        self.load(self.write_page(out))
        self.assertEqual(self.script("const s = document.getElementById('scene-up'); "
                                     "return s.options[s.selectedIndex].textContent"), "+z")

    def test_without_truth_it_says_why(self):
        self.load(self.write_page(self.runs[0]))
        self.assertIn("no truth was given", " ".join(self.texts("#summary-notes .note")))
        self.assertTrue(self.script("return document.getElementById('errors').hidden"))
        self.assertGreater(self.shades("#scene canvas"), 30)


def missing():
    for program in ("chromium", "chromedriver"):
        if not shutil.which(program):
            return program
    try:
        import selenium  # noqa: F401
    except ImportError:
        return "Selenium (python3-selenium)"
    return None


if __name__ == "__main__":
    DEEPUAV = os.path.abspath(sys.argv.pop(1))
    if len(sys.argv) > 1 and not sys.argv[1].startswith("-"):
        SCREENSHOTS = sys.argv.pop(1)
    if absent := missing():
        print(f"skipped: no {absent}")
        sys.exit(SKIPPED)
    unittest.main()
