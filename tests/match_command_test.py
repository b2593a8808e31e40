#!/usr/bin/env python3
"""`deepuav match` as its users meet it.

  match_command_test.py DEEPUAV
"""
import math
import re
import shutil
import statistics
import struct

from model_fixtures import MODELS, ModelTest, call, dual_softmax_matcher, png, scene
from program_under_test import WRONG_USE, main


def crop(rows, left, top, width, height):
    return [row[left:left + width] for row in rows[top:top + height]]


def half_a_pixel_on(rows):
    """What lay at x lies at x - 0.5."""
    return [bytes((a + b) // 2 for a, b in zip(row, row[1:])) for row in rows]


def doubled(rows):
    """Twice as large: what lay at x lies at 2 x + 0.5."""
    def blend(a, b):
        return bytes((3 * p + q + 2) // 4 for p, q in zip(a, b))

    def stretch(lines):
        out = []
        for i, line in enumerate(lines):
            out += [blend(line, lines[max(i - 1, 0)]), blend(line, lines[min(i + 1, len(lines) - 1)])]
        return out

    def transpose(lines):
        return [bytes(column) for column in zip(*lines)]

    return transpose(stretch(transpose(stretch(rows))))


def png_size(file):
    content = file.read_bytes()
    assert content.startswith(b"\x89PNG") and content.endswith(b"IEND\xaeB`\x82")
    return struct.unpack(">II", content[16:24])


def parse(text):
    return [tuple(map(float, line.split())) for line in text.splitlines()]


class Match(ModelTest):
    @classmethod
    def setUpClass(cls):
        cls.rows = scene()

    def match(self, *arguments):
        return parse(self.succeed("match", *arguments, "--precision", "fp32"))

    def errors_px(self, matches, expected):
        return [max(abs(x1 - expected(x0, y0)[0]), abs(y1 - expected(x0, y0)[1])) for x0, y0, x1, y1, _ in matches]

    def expect_transformation(self, matches, expected, at_least, within_px=1, share=0.8):
        self.assertGreaterEqual(len(matches), at_least)
        errors = self.errors_px(matches, expected)
        self.assertGreater(sum(error <= within_px for error in errors) / len(errors), share, sorted(errors))
        self.assertEqual([m[4] for m in matches], sorted((m[4] for m in matches), reverse=True))
        self.assertTrue(all(0 <= m[4] <= 1 for m in matches))

    def test_shift(self):
        """Of whole pixels, and sizes that are no multiples of 8."""
        a = png(self.folder / "a.png", crop(self.rows, 0, 0, 283, 211))
        b = png(self.folder / "b.png", crop(self.rows, 17, 10, 290, 221))
        self.expect_transformation(self.match(a, b), lambda x, y: (x - 17, y - 10), at_least=80)

    def test_half_a_pixel(self):
        a = png(self.folder / "a.png", self.rows)
        b = png(self.folder / "b.png", half_a_pixel_on(self.rows))
        matches = self.match(a, b)
        self.expect_transformation(matches, lambda x, y: (x - 0.5, y), at_least=80)
        self.assertAlmostEqual(statistics.median(x1 - x0 for x0, _, x1, _, _ in matches), -0.5, delta=0.1)
        self.assertAlmostEqual(statistics.median(y1 - y0 for _, y0, _, y1, _ in matches), 0, delta=0.05)

    def test_scale(self):
        """Twice the size: seen at the same size, both smaller than they are, and at another."""
        a = png(self.folder / "a.png", self.rows)
        b = png(self.folder / "b.png", doubled(self.rows))

        def twice(x, y):
            return 2 * x + 0.5, 2 * y + 0.5

        for max_side_px, offset_px in ((320, 0.1), (240, 0.15)):
            matches = self.match(a, b, "--max-side", str(max_side_px))
            self.expect_transformation(matches, twice, at_least=80)
            for axis in (0, 1):  # half a pixel off shows here
                offsets = [m[2 + axis] - 2 * m[axis] for m in matches]
                self.assertAlmostEqual(statistics.median(offsets), 0.5, delta=offset_px)
        seen_larger = self.match(a, b, "--max-side", "500")
        self.expect_transformation(seen_larger, twice, at_least=80, within_px=2, share=0.6)

    def test_headings(self):
        turned = [bytes(column) for column in zip(*self.rows[::-1])]  # clockwise
        height = len(self.rows)
        a, b = png(self.folder / "a.png", self.rows), png(self.folder / "b.png", turned)
        matches = self.match(a, b, "--headings")
        self.expect_transformation(matches, lambda x, y: (height - 1 - y, x), at_least=80)
        self.assertGreater(len(matches), len(self.match(a, b)))
        upright = self.match(a, a, "--headings")
        self.assertEqual(upright, self.match(a, a))

    def test_superglue(self):
        """Scores are the assignment's; both images of their own size."""
        network = dual_softmax_matcher(self.folder)
        a = png(self.folder / "a.png", self.rows)
        b = png(self.folder / "b.png", crop(self.rows, 17, 10, 290, 221))
        matches = self.match(a, b, "--set", "matching.method=superglue", "--set", f"superglue.model={network}", "--set",
                             "superglue.min_score=0.05")
        self.expect_transformation(matches, lambda x, y: (x - 17, y - 10), at_least=50)
        self.assertTrue(all(m[4] >= 0.05 for m in matches))

    def test_shipped_superglue(self):
        a = png(self.folder / "a.png", self.rows)
        b = png(self.folder / "b.png", crop(self.rows, 17, 10, 290, 221))
        superglue = ("--set", "matching.method=superglue")
        matches = self.match(a, b, *superglue)
        self.expect_transformation(matches, lambda x, y: (x - 17, y - 10), at_least=50)
        self.assertTrue(all(0.2 <= m[4] <= 1 for m in matches))
        self.assertEqual(matches, self.match(a, b, *superglue))
        self.assertEqual(matches, self.match(a, b), "the default")

    def test_other_networks_are_matched_by_nearest_neighbours(self):
        a = png(self.folder / "a.png", self.rows)
        b = png(self.folder / "b.png", crop(self.rows, 17, 10, 290, 221))
        network = self.folder / "mine.onnx"
        shutil.copy(MODELS / "superpoint_small.onnx", network)
        nearest = ("--set", "matching.method=nearest")
        self.assertEqual(self.match(a, b, "--model", str(network)), self.match(a, b, "--model", str(network), *nearest))
        self.assertNotEqual(self.match(a, b), self.match(a, b, *nearest))

    def pair_list(self, text):
        file = self.folder / "pairs.txt"
        file.write_text(text)
        return file

    def test_refined_places_are_more_precise(self):
        a = png(self.folder / "a.png", self.rows)
        b = png(self.folder / "b.png", crop(self.rows, 8, 4, 300, 220))

        def median_error(*arguments):
            matches = parse(self.succeed("match", a, b, "--precision", "fp32", *arguments))
            return sorted(math.hypot(m[2] - m[0] + 8, m[3] - m[1] + 4) for m in matches)[len(matches) // 2]

        self.assertLess(median_error(), 0.5 * median_error("--no-refine") + 0.01)

    def test_pair_list(self):
        images = self.folder / "images"
        images.mkdir()
        a = png(images / "a.png", self.rows)
        png(images / "b.png", crop(self.rows, 8, 4, 300, 220))
        pairs = self.pair_list(f"a.png b.png 0.5 1 more\n\n  \n# a remark\n{a}\tb.png\nb.png a.png\n")
        out = self.folder / "out"
        # Without refinement, which moves the places in the second image only, both ways give the same.
        printed = self.succeed("match", "--pairs", pairs, "--images", images, "--out", out, "--draw", "--precision",
                               "fp32", "--no-refine")
        self.assertIn("3 pairs", printed)
        self.assertEqual({file.name for file in out.iterdir()},
                         {f"0000{i}.{ending}" for i in range(3) for ending in ("txt", "png")})
        first, second, back = (parse((out / f"0000{i}.txt").read_text()) for i in range(3))
        self.expect_transformation(first, lambda x, y: (x - 8, y - 4), at_least=80)
        self.assertEqual(first, second)
        self.assertEqual({(m[2], m[3], m[0], m[1]) for m in back}, {m[:4] for m in first})
        self.assertEqual(png_size(out / "00000.png"), (len(self.rows[0]) + 300, len(self.rows)))
        to_stdout = self.succeed("match", "--pairs", pairs, "--precision", "fp32", "--no-refine", folder=images)
        parts = re.split(r"(?m)^# \d .*\n", to_stdout)
        self.assertEqual([parse(part) for part in parts[1:]], [first, second, back])

    def test_picture_of_one_pair(self):
        a = png(self.folder / "a.png", self.rows)
        size = (2 * len(self.rows[0]), len(self.rows))
        self.match(a, a, "--draw", self.folder / "picture.png")
        self.assertEqual(png_size(self.folder / "picture.png"), size)
        self.succeed("match", a, a, "--draw", folder=self.folder)
        self.assertEqual(png_size(self.folder / "matches.png"), size)
        self.succeed("match", a, a, "--draw", "--out", self.folder / "out", "--max-side", "160")
        self.assertEqual(png_size(self.folder / "out/00000.png"), (320, 120))
        self.assertTrue((self.folder / "out/00000.txt").read_text())

    def test_nothing_in_common(self):
        a = png(self.folder / "a.png", self.rows)
        grey = png(self.folder / "grey.png", [bytes([90]) * 64] * 48)
        tiny = png(self.folder / "tiny.png", [b"\x10"])
        for other in (grey, tiny):
            self.assertEqual(self.succeed("match", a, other), "")

    def test_wrong_lists_and_images(self):
        a = png(self.folder / "a.png", self.rows)
        broken = self.folder / "broken.png"
        broken.write_bytes(a.read_bytes()[:500])
        self.expect_failure(call("match", a, broken), "broken.png", "breaks off after 500 bytes")
        self.expect_failure(call("match", a, self.folder / "none.png"), "none.png")
        self.expect_failure(call("match", a, a, "--draw", a), "a.png", "is the input")
        self.expect_failure(call("match", a, a, "--draw", self.folder / "absent/b.png"), "absent/b.png")
        frames = self.folder / "frames"
        frames.mkdir()
        second = png(frames / "00001.png", self.rows)
        pairs = self.pair_list(f"{a} {a}\n{a} {second}\n")
        before = second.read_bytes()
        self.expect_failure(call("match", "--pairs", pairs, "--out", frames, "--draw"), "00001.png", "is the input")
        self.assertEqual(second.read_bytes(), before)
        out = self.folder / "out"
        for text, parts in (("a.png\n", ["pairs.txt:1", "'a.png'", "two images"]),
                            ("\n# x\n", ["pairs.txt", "no pair"]),
                            ("a.png a.png\n\na.png none.png\n", ["pairs.txt:3", "none.png", "no such file"]),
                            (f"a.png {'n' * 300}.png\n", ["pairs.txt:1", "nnn.png", "no such file"]),
                            ("a.png a.png\na.png broken.png\n", ["pairs.txt:2", "broken.png", "breaks off"])):
            with self.subTest(text):
                pairs = self.pair_list(text)
                self.expect_failure(call("match", "--pairs", pairs, "--images", self.folder, "--out", out), *parts)
        self.assertEqual([file.name for file in out.iterdir()], ["00000.txt"])  # what was found before the damaged one
        self.expect_failure(call("match", "--pairs", self.folder / "absent.txt"), "absent.txt")
        (self.folder / "file").write_text("")
        self.expect_failure(call("match", a, a, "--out", self.folder / "file/out"), "file/out", "output folder")

    def test_wrong_use(self):
        pairs = self.pair_list("a b\n")
        for arguments, part in (([], "two images"), (["a"], "two images"), (["--draw", "a", "b"], "before --draw"),
                                (["a", "b", "--pairs", pairs], "--pairs"),
                                (["--pairs", pairs, "--draw"], "--out"), (["a", "b", "--images", "."], "--pairs"),
                                (["--pairs", pairs, "--out", "o", "--draw", "p.png"], "--draw"),
                                (["a", "b", "--max-side", "0"], "--max-side"),
                                (["a", "b", "--draw", "x.jpg"], "PNG"),
                                (["a", "b", "--set", "matching.method=superglu"], "superglue")):
            with self.subTest(arguments=arguments):
                self.expect_failure(call("match", *arguments), part, status=WRONG_USE)


if __name__ == "__main__":
    main(__doc__)
