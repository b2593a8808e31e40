#!/usr/bin/env python3
"""`cmake --install` gives a folder that can be moved anywhere and needs nothing of the source tree.

  install_test.py CMAKE BUILD_FOLDER
"""
import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import layered_scene

ROOT = Path(__file__).resolve().parent.parent
CMAKE = BUILD = None


class InstallTest(unittest.TestCase):
    def test_it_runs_where_it_was_moved_to(self):
        with tempfile.TemporaryDirectory(prefix="deepuav-install-test-") as scratch:
            scratch = Path(scratch)
            subprocess.run([CMAKE, "--install", BUILD, "--prefix", scratch / "first"], check=True, capture_output=True)
            (scratch / "first").rename(scratch / "moved")
            program = scratch / "moved/bin/deepuav"
            self.assertNotIn(os.fsencode(ROOT / "models"), program.read_bytes())
            environment = {"PATH": os.environ["PATH"], "XDG_CACHE_HOME": str(scratch / "cache")}

            def call(*arguments):
                return subprocess.run([program, *map(os.fspath, arguments)], capture_output=True, text=True, check=True,
                                      env=environment, cwd=scratch).stdout

            models = json.loads(call("models", "--json"))
            self.assertGreater(len(models), 0)
            for model in models:
                self.assertEqual(model["state"], "ok")
                self.assertTrue(model["file"].startswith(str(scratch / "moved")), model["file"])
            if "DEEPUAV_SIMULATION:BOOL=ON" in (Path(BUILD) / "CMakeCache.txt").read_text():
                for flight in (ROOT / "flights").glob("*.yaml"):
                    self.assertIn(f"  {flight.stem} ", call("simulate", "--list"))
            loaded = subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout
            self.assertIn(f"{scratch}/moved/bin/../", [line for line in loaded.splitlines() if "libopenvino.so" in line][0])

            scene = layered_scene.euroc(scratch / "scene", 2)
            first, second = sorted((scene / "mav0/cam0/data").iterdir())
            self.assertGreater(len(call("match", first, second).splitlines()), 20)


if __name__ == "__main__":
    CMAKE, BUILD = sys.argv[1:3]
    unittest.main(argv=sys.argv[:1])
