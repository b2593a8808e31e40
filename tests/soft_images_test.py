#!/usr/bin/env python3
"""A sequence whose images are soft: `deepuav run` shows the network fewer of their pixels, and so does who goes on with its map.

  soft_images_test.py DEEPUAV
"""
import itertools
import json
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

import layered_scene
from program_under_test import TIMEOUT_S, command, main

FRAMES, RADIUS_PX = 24, 4


def blurred(line):
    """The mean about each of the line's values."""
    padded = [line[0]] * (RADIUS_PX + 1) + list(line) + [line[-1]] * RADIUS_PX
    sums = list(itertools.accumulate(padded))
    return [(high - low) // (2 * RADIUS_PX + 1) for low, high in zip(sums, sums[2 * RADIUS_PX + 1:])]


def soft(rows):
    for _ in range(2):
        rows = list(zip(*map(blurred, rows)))  # Along rows, then along columns: each turns the image.
        rows = list(zip(*map(blurred, rows)))
    return rows


class SoftImages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="deepuav-soft-images-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        os.environ["XDG_CACHE_HOME"] = str(cls.folder / "cache")
        cls.sharp = layered_scene.euroc(cls.folder / "sharp", FRAMES)
        cls.soft = layered_scene.euroc(cls.folder / "soft", FRAMES, rows_of=soft)

    def run_over(self, scene, name, *more):
        """Its summary and what it said."""
        result = subprocess.run(command("run", scene, "--out", self.folder / name, *more), capture_output=True, text=True,
                                timeout=TIMEOUT_S)
        return json.loads((self.folder / name / "summary.json").read_text()), result.stderr

    def test_sharp_ones_are_seen_whole(self):
        summary, said = self.run_over(self.sharp, "of_sharp")
        self.assertNotIn(" at ", summary["features"])
        self.assertNotIn("soft", said)

    def test_soft_ones_are_reduced_and_so_are_those_of_their_map(self):
        summary, said = self.run_over(self.soft, "of_soft")
        self.assertRegex(summary["features"], " at [0-9]+x[0-9]+$")
        self.assertIn("the images are soft", said)
        self.assertLess(float(summary["options"]["features.network_pixels"]), layered_scene.WIDTH * layered_scene.HEIGHT)
        again, said = self.run_over(self.soft, "again", "--map", self.folder / "of_soft/map.deepuav",
                                    "--set", "features.reduce_soft=false")
        self.assertEqual(again["features"], summary["features"])
        self.assertNotIn("made with", said)

    def test_photographs_are_looked_at_further_reduced(self):
        photographs = layered_scene.photographs(self.soft, self.folder / "photographs")
        elsewhere = layered_scene.euroc(self.folder / "elsewhere", 1, seed=2, rows_of=soft)
        shutil.copy(next((elsewhere / "mav0/cam0/data").iterdir()), photographs / "9999.png")
        summary, said = self.run_over(photographs, "survey")
        self.assertRegex(summary["features"], " at [0-9]+x[0-9]+$")
        self.assertIn("1 photographs are in no map: 9999.png", said)
        self.assertNotIn("network_pixels is", said)

    def test_asked_to_they_are_seen_whole(self):
        summary, _ = self.run_over(self.soft, "whole", "--set", "features.reduce_soft=false")
        self.assertNotIn(" at ", summary["features"])


if __name__ == "__main__":
    main(__doc__)
