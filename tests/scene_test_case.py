"""Tests that fly over the layered scene, in a folder of their own."""
import os
import tempfile
import unittest
from pathlib import Path

import layered_scene

FRAMES = 40


class SceneTest(unittest.TestCase):
    """`scratch` is the folder, `scene` the dataset in it; the program's cache lies there, too."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix=f"deepuav-{cls.__name__}-")
        cls.addClassCleanup(folder.cleanup)
        cls.scratch = Path(folder.name)
        os.environ["XDG_CACHE_HOME"] = str(cls.scratch / "cache")
        cls.scene = layered_scene.euroc(cls.scratch / "scene", FRAMES)
