"""What the tests of shipped models share: the program, a matcher of theirs, and what it may say."""
import json
import os
import shutil
import struct
import subprocess
import tempfile
import unittest
import zlib
from pathlib import Path

import layered_scene
from program_under_test import FAILURE, command

MODELS = Path(__file__).resolve().parent.parent / "models"
DESCRIPTOR_DIMENSION = 256

scratch = tempfile.TemporaryDirectory(prefix="deepuav-model-test-")
SCRATCH = Path(scratch.name)
# The first command compiles the network, the others find it there; and the user's own cache stays as it is.
ENVIRONMENT = {**os.environ, "XDG_CACHE_HOME": str(SCRATCH / "cache")}
ENVIRONMENT.pop("DEEPUAV_MODELS", None)


def call(*arguments, models=None, folder=None):
    environment = {**ENVIRONMENT, "DEEPUAV_MODELS": str(models)} if models else ENVIRONMENT
    return subprocess.run(command(*arguments), capture_output=True, text=True, env=environment,
                          cwd=folder, timeout=300, check=False)


def shipped_networks():
    """File names by (size, precision) of the SuperPoint networks that models.yaml names."""
    return {(m["size"], m["precision"]): Path(m["file"]).name
            for m in json.loads(call("models", "--json").stdout) if m["kind"] == "superpoint"}


def png(file, rows):
    def chunk(kind, content):
        body = kind + content
        return struct.pack(">I", len(content)) + body + struct.pack(">I", zlib.crc32(body))

    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 0, 0, 0, 0)
    pixels = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows), 1)
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) + chunk(b"IEND", b""))
    return file


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
