"""What the tests of saved maps share: the program, two runs over one scene, and what it may say."""
import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import layered_scene
from program_under_test import FAILURE, command

ROOT = Path(__file__).resolve().parent.parent
MODEL = ROOT / "models/superpoint_small.onnx"
OLD_FRAMES, NEW_FRAMES = 14, 24

scratch = tempfile.TemporaryDirectory(prefix="deepuav-map-test-")
SCRATCH = Path(scratch.name)
SCENE, OLD, NEW = SCRATCH / "scene", SCRATCH / "old", SCRATCH / "new"
# The first run compiles the network, the others find it there; and the user's own cache stays as it is.
ENVIRONMENT = dict(os.environ, XDG_CACHE_HOME=str(SCRATCH / "cache"))


def call(*arguments):
    return subprocess.run(command(*arguments), capture_output=True, text=True, env=ENVIRONMENT, timeout=200,
                          check=False)


def run_arguments(dataset, out, *more):
    return ("run", dataset, "--out", out, "--set", f"features.model={MODEL}", "--set", "features.keypoints=300",
            "--set", "places.vocabulary=", "--log-level", "warn", *more)


def succeed(*arguments):
    result = call(*arguments)
    if result.returncode != 0 or result.stderr:
        raise AssertionError(f"{arguments}: {result.returncode}: {result.stderr}")
    return result.stdout


def info(file):
    return json.loads(succeed("map", "info", file, "--json"))


def setUpModule():
    layered_scene.euroc(SCENE, NEW_FRAMES)
    succeed(*run_arguments(SCENE, OLD, "--end", str(OLD_FRAMES)))
    succeed(*run_arguments(SCENE, NEW))


class MapTest(unittest.TestCase):
    def setUp(self):
        self.folder = SCRATCH / self.id().rsplit(".", 1)[-1]
        self.folder.mkdir()
        self.map = NEW / "map.deepuav"

    def expect_failure(self, arguments, *parts, status=FAILURE):
        result = call(*arguments)
        self.assertEqual(result.returncode, status, result.stderr)
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        self.assertTrue(result.stderr.startswith("deepuav: "), result.stderr)
        self.assertEqual(result.stdout, "")
        for part in parts:
            self.assertIn(part, result.stderr)

    def export(self, form, name, *more, file=None):
        out = self.folder / name
        succeed("map", "export", file or self.map, "--format", form, "--out", out, *more)
        return out
