#!/usr/bin/env python3
"""Shipped models as their users meet them: `deepuav models`, `match`, `bench networks`, and the arguments that choose
networks and their arithmetic.

  model_command_test.py DEEPUAV
"""
import hashlib
import json
import math
import os
import re
import shutil
import statistics
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib
from pathlib import Path

import command_test_data as data
import layered_scene

FAILURE, WRONG_USE = 1, 2
MODELS = Path(__file__).resolve().parent.parent / "models"
DESCRIPTOR_DIMENSION = 256

DEEPUAV = None
scratch = tempfile.TemporaryDirectory(prefix="deepuav-model-test-")
SCRATCH = Path(scratch.name)
# The first command compiles the network, the others find it there; and the user's own cache stays as it is.
ENVIRONMENT = {**os.environ, "XDG_CACHE_HOME": str(SCRATCH / "cache")}
ENVIRONMENT.pop("DEEPUAV_MODELS", None)


def call(*arguments, models=None, folder=None):
    environment = {**ENVIRONMENT, "DEEPUAV_MODELS": str(models)} if models else ENVIRONMENT
    return subprocess.run([DEEPUAV, *map(os.fspath, arguments)], capture_output=True, text=True, env=environment,
                          cwd=folder, timeout=300, check=False)


def shipped_networks():
    """File names by (size, precision) of the SuperPoint networks that models.yaml names."""
    return {(m["size"], m["precision"]): Path(m["file"]).name
            for m in json.loads(call("models", "--json").stdout) if m["kind"] == "superpoint"}


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


def png(file, rows):
    def chunk(kind, content):
        body = kind + content
        return struct.pack(">I", len(content)) + body + struct.pack(">I", zlib.crc32(body))

    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 0, 0, 0, 0)
    pixels = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows), 1)
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) + chunk(b"IEND", b""))
    return file


def png_size(file):
    content = file.read_bytes()
    assert content.startswith(b"\x89PNG") and content.endswith(b"IEND\xaeB`\x82")
    return struct.unpack(">II", content[16:24])


def parse(text):
    return [tuple(map(float, line.split())) for line in text.splitlines()]


def scene():
    return layered_scene.draw(layered_scene.make_cards(layered_scene.random.Random(4)), 0, 0)


def dual_softmax_matcher(folder):
    """A matcher with SuperGlue's interface as an OpenVINO file: the dual softmax of 20 times the similarity."""
    shapes = {"keypoints": "1,?,2", "scores": "1,?", "descriptors": f"1,?,{DESCRIPTOR_DIMENSION}"}
    layers, edges = [], []

    def ports(count, first=0):
        return "".join(f'<port id="{first + i}" precision="FP32"/>' for i in range(count))

    def layer(name, kind, attributes, inputs, version="opset1"):
        number = len(layers)
        for port, source in enumerate(inputs):
            edges.append((source, port, number, port))
        taken = f"<input>{ports(len(inputs))}</input>" if inputs else ""
        given = "" if kind == "Result" else (
            f'<output><port id="{len(inputs)}" precision="FP32" names="{name}"/></output>')
        layers.append((f'<layer id="{number}" name="{name}" type="{kind}" version="{version}">'
                       f"<data {attributes}/>{taken}{given}</layer>", len(inputs)))
        return number

    numbers = {name + side: layer(name + side, "Parameter", f'shape="{shape}" element_type="f32"', [])
               for side in "01" for name, shape in shapes.items()}
    factor = layer("factor", "Const", 'element_type="f32" shape="" offset="0" size="4"', [])
    cosine = layer("cosine", "MatMul", 'transpose_a="false" transpose_b="true"',
                   [numbers["descriptors0"], numbers["descriptors1"]])
    similarity = layer("similarity", "Multiply", 'auto_broadcast="numpy"', [cosine, factor])
    rows = layer("rows", "SoftMax", 'axis="1"', [similarity])
    columns = layer("columns", "SoftMax", 'axis="2"', [similarity])
    product = layer("assignment", "Multiply", 'auto_broadcast="numpy"', [rows, columns])
    layer("result", "Result", "", [product])
    joined = "".join(f'<edge from-layer="{a}" from-port="{layers[a][1]}" to-layer="{b}" to-port="{port}"/>'
                     for a, _, b, port in edges)
    file = folder / "dual_softmax.xml"
    file.write_text(f'<?xml version="1.0"?><net name="dual_softmax" version="11"><layers>'
                    f"{''.join(text for text, _ in layers)}</layers><edges>{joined}</edges></net>")
    file.with_suffix(".bin").write_bytes(struct.pack("<f", 20))
    return file


class ModelTest(unittest.TestCase):
    def setUp(self):
        self.folder = SCRATCH / self.id().split(".", 1)[-1]
        self.folder.mkdir()

    def succeed(self, *arguments, **options):
        result = call(*arguments, **options)
        self.assertEqual((result.returncode, result.stderr), (0, ""), result.stderr)
        return result.stdout

    def expect_failure(self, result, *parts, status=FAILURE):
        self.assertEqual(result.returncode, status, result.stderr)
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        self.assertTrue(result.stderr.startswith("deepuav: "), result.stderr)
        for part in parts:
            self.assertIn(part, result.stderr)

    def copy_of_models(self):
        return Path(shutil.copytree(MODELS, self.folder / "models"))


class Models(ModelTest):
    def test_lists_them(self):
        text = self.succeed("models")
        table = json.loads(self.succeed("models", "--json"))
        self.assertIn(str(MODELS / "superpoint_small.onnx"), {model["file"] for model in table})
        for model in table:
            file = Path(model["file"])
            self.assertEqual(model["state"], "ok")
            parts = [file, file.with_suffix(".bin")] if file.suffix == ".xml" else [file]
            whole = b"".join(part.read_bytes() for part in parts)
            self.assertEqual((model["bytes"], model["sha256"]), (len(whole), hashlib.sha256(whole).hexdigest()))
            self.assertTrue(Path(model["card"]).is_file())
            row = [line for line in text.splitlines() if line.split()[0] == model["name"]]
            self.assertEqual(len(row), 1)
            for part in (model["kind"], file.name, model["sha256"][:12], " ok ", model["licence"], model["card"]):
                self.assertIn(part, row[0])

    def test_damaged_and_missing(self):
        models = self.copy_of_models()
        with (models / "superpoint_small.onnx").open("r+b") as file:
            file.seek(1000)
            byte = file.read(1)
            file.seek(1000)
            file.write(bytes([byte[0] ^ 1]))
        (models / "vocabulary.bin").unlink()
        result = call("models", models=models)
        self.expect_failure(result, "superpoint_small is damaged", "vocabulary is missing")
        self.assertRegex(result.stdout, r"superpoint_small .* damaged ")
        self.assertRegex(result.stdout, r"vocabulary .* missing ")
        found = hashlib.sha256((models / "superpoint_small.onnx").read_bytes()).hexdigest()
        expected = hashlib.sha256((MODELS / "superpoint_small.onnx").read_bytes()).hexdigest()
        dataset = data.small_euroc(self.folder / "dataset")
        image = png(self.folder / "image.png", scene())
        for command in (["run", dataset, "--out", self.folder / "out", "--precision", "fp32"],
                        ["match", image, image, "--precision", "fp32"], ["bench", "networks"]):
            self.expect_failure(call(*command, models=models), "superpoint_small.onnx", found, expected)

    def test_missing_vocabulary(self):
        models = self.copy_of_models()
        (models / "vocabulary.bin").unlink()
        dataset = data.small_euroc(self.folder / "dataset")
        self.expect_failure(call("run", dataset, "--out", self.folder / "out", models=models), "vocabulary.bin",
                            "no such file", "shipped model vocabulary")

    def test_no_registry(self):
        empty = self.folder / "empty"
        empty.mkdir()
        for command in (["models"], ["run", "x", "--out", "y"], ["match", "a", "b"]):
            self.expect_failure(call(*command, models=empty), "models.yaml")


class Choice(ModelTest):
    def refuse(self, arguments, *parts, models=None):
        result = call("run", "nowhere", "--out", self.folder / "out", *arguments, models=models)
        self.expect_failure(result, *parts, status=WRONG_USE)

    def test_wrong_choices(self):
        self.refuse(["--features", "huge"], "'huge'", "small (fp32)")
        self.refuse(["--set", "features.size=huge"], "'huge'", "small (fp32)")
        self.refuse(["--precision", "fp16"], "fp16")
        self.refuse(["--features", "small", "--model", "x.onnx"], "--features", "--model")
        self.refuse(["--precision", "fp32", "--set", "inference.precision=fp32"], "--precision fp32",
                    "--set inference.precision=fp32")
        self.refuse(["--features", "small", "--set", "features.model=x"], "--features small", "features.model=x")
        self.refuse(["--model", "y", "--set", "features.size=small"], "--model y", "features.size=small")

    def test_demo_refuses_before_it_renders(self):
        out = self.folder / "demo"
        self.expect_failure(call("demo", "--out", out, "--features", "huge"), "'huge'", status=WRONG_USE)
        self.expect_failure(call("demo", "--out", out, "--model", "absent.onnx"), "absent.onnx", "no such file")
        self.assertFalse(out.exists())

    def test_precision_that_is_not_shipped(self):
        models = self.copy_of_models()
        registry = (models / "models.yaml").read_text()
        (models / "models.yaml").write_text(re.sub(r"(?m)^\w+:\n(?:  (?!precision: int8).*\n)*  precision: int8\n"
                                                   r"(?:  .*\n)*", "", registry))
        self.refuse(["--precision", "int8"], "no superpoint of size 'small' is shipped for the precision int8",
                    "small (fp32)", models=models)

    def test_own_network_that_is_not_quantised(self):
        dataset = data.small_euroc(self.folder / "dataset")
        own = shutil.copy(MODELS / "superpoint_small.onnx", self.folder / "own.onnx")
        self.expect_failure(call("run", dataset, "--out", self.folder / "out", "--model", own, "--precision", "int8"),
                            "own.onnx", "is not quantised")

    def run_summary(self, *arguments):
        """Of a run too short for a map, which has a summary nevertheless."""
        dataset, out = self.folder / "dataset", self.folder / "out"
        if not dataset.exists():
            layered_scene.euroc(dataset, 2)
        self.expect_failure(call("run", dataset, "--out", out, "--log-level", "error", *arguments),
                            "no map was started")
        return json.loads((out / "summary.json").read_text())

    def test_summary_names_the_models(self):
        summary = self.run_summary("--precision", "fp32")
        models = {model["use"]: model for model in summary["models"]}
        self.assertEqual(set(models), {"features", "vocabulary"})
        for use, name in (("features", "superpoint_small"), ("vocabulary", "vocabulary")):
            self.assertEqual(models[use]["shipped_as"], name)
            self.assertEqual(models[use]["sha256"],
                             hashlib.sha256(Path(models[use]["file"]).read_bytes()).hexdigest())
        self.assertEqual(summary["options"]["inference.precision"], "fp32")
        self.assertTrue(summary["features"].endswith(" fp32"))

    def test_own_network(self):
        own = shutil.copy(MODELS / "superpoint_small.onnx", self.folder / "own.onnx")
        config = self.folder / "options.yaml"
        config.write_text("places:\n  vocabulary: ''\n")
        summary = self.run_summary("--model", own, "--config", config, "--precision", "fp32")
        self.assertEqual(summary["models"], [{"use": "features", "file": str(own), "sha256": hashlib.sha256(
            Path(own).read_bytes()).hexdigest(), "shipped_as": None}])

    def test_argument_wins_over_file(self):
        config = self.folder / "options.yaml"
        config.write_text("features:\n  model: absent.onnx\ninference:\n  precision: bf16\n")
        for choice in (["--features", "small", "--precision", "fp32"],
                       ["--set", "features.size=small", "--set", "inference.precision=fp32"]):
            summary = self.run_summary("--config", config, *choice)
            self.assertEqual(summary["models"][0]["shipped_as"], "superpoint_small")
            self.assertEqual(summary["options"]["inference.precision"], "fp32")


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


class Bench(ModelTest):
    ROW = re.compile(r"\| (?P<network>\S+) \| (?P<precision>\S+) \| (?P<threads>[^|]+) \| (?P<median>[^|]+) \| "
                     r"(?P<range>[^|]+) \| (?P<runs>\S+) \|")

    def table(self, *arguments):
        text = self.succeed("bench", "networks", "--size", "160x123", "--seconds", "0", *arguments)
        lines = [line for line in text.splitlines() if line.startswith("|")][2:]
        return text, [self.ROW.fullmatch(line).groupdict() for line in lines]

    def test_networks(self):
        matcher = dual_softmax_matcher(self.folder)
        text, rows = self.table("--threads", "1", "--model", matcher, "--points", "64")
        self.assertIn("160x123, 64 key points", text)
        shipped = {Path(m["file"]).name for m in json.loads(call("models", "--json").stdout) if m["precision"]}
        self.assertIn("superglue.onnx", shipped)
        names = {*shipped, "dual_softmax.xml"}
        self.assertEqual({row["network"] for row in rows}, names)
        for row in rows:
            if row["median"] == "not in this CPU":
                self.assertIn(row["precision"], ("bf16", "int8"))
                continue
            self.assertEqual(row["threads"], "1")
            low, high = map(float, row["range"].split(" to "))
            self.assertLessEqual(low, float(row["median"]))
            self.assertLessEqual(float(row["median"]), high)
            self.assertGreaterEqual(int(row["runs"]), 10)
        self.assertEqual({row["precision"] for row in rows if row["network"] == "superpoint_small.onnx"},
                         {"fp32", "bf16"})

    def test_what_does_not_fit_is_marked(self):
        _, rows = self.table("--precisions", "int8", "--threads", "1")
        row = next(row for row in rows if row["network"] == "superpoint_small.onnx")
        self.assertEqual((row["precision"], row["median"], row["runs"]), ("int8", "not quantised", "-"))

    def test_wrong_use(self):
        for arguments, part in ((["--size", "752"], "WIDTHxHEIGHT"), (["--size", "0x9"], "WIDTHxHEIGHT"),
                                (["--threads", "0"], "--threads"), (["--precisions", "fp16"], "fp16"),
                                (["--points", "0"], "--points"), (["--seconds", "-1"], "--seconds"),
                                (["--seconds", "nan"], "--seconds")):
            with self.subTest(arguments=arguments):
                self.expect_failure(call("bench", "networks", *arguments), part, status=WRONG_USE)
        self.expect_failure(call("bench"), "subcommand", status=WRONG_USE)
        self.expect_failure(call("bench", "networks", "--model", "absent.onnx"), "absent.onnx", "no such file")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    DEEPUAV = str(Path(sys.argv.pop(1)).resolve())
    unittest.main()
