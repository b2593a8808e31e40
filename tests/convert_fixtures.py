"""What the tests of `python -m deepuav.convert` share: the module, and bags that they make themselves."""
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

import layered_scene
from bag_writer import Bag
from jpeg_encoder import jpeg
from program_under_test import command

ROOT = Path(__file__).resolve().parent.parent

# The package as it lies in the sources, without its compiled part, which this one does not need.
package = types.ModuleType("deepuav")
package.__path__ = [os.fspath(ROOT / "python/deepuav")]
sys.modules["deepuav"] = package
from deepuav import convert as module

FRAMES = 20
# The camera looks along the body's x: its z is x, its x is -y, its y is -z.
CAMERA_IN_BODY = (0.5, -0.5, 0.5, -0.5)


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

    def run_converted(self):
        return subprocess.run(command("run", self.out, "--out", self.folder / "run", "--log-level", "warn"),
                              capture_output=True, text=True, check=False,
                              env={**os.environ, "XDG_CACHE_HOME": os.fspath(self.folder / "cache")})
