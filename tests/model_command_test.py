#!/usr/bin/env python3
"""Shipped models as their users meet them: `deepuav models`, `bench networks`, and the arguments that choose networks and
their arithmetic.

  model_command_test.py DEEPUAV
"""
import hashlib
import json
import re
import shutil
from pathlib import Path

import command_test_data as data
import layered_scene
from model_fixtures import MODELS, ModelTest, call, dual_softmax_matcher, png, scene
from program_under_test import WRONG_USE, main


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

    def test_a_survey_may_ask_superglue_where_nobody_chose_a_matcher(self):
        dataset, photographs = self.folder / "dataset", self.folder / "photographs"
        layered_scene.euroc(dataset, 2)
        shutil.copytree(dataset / "mav0/cam0/data", photographs)
        own = shutil.copy(MODELS / "superpoint_small.onnx", self.folder / "own.onnx")
        for arguments, is_there in (([], True), (["--set", "matching.method=nearest"], False), (["--model", own], False)):
            out = self.folder / f"out{len(arguments)}{is_there}{arguments[-1:] == [own]}"
            call("run", photographs, "--out", out, "--log-level", "error", "--precision", "fp32", *arguments)
            models = {model["use"]: model for model in json.loads((out / "summary.json").read_text())["models"]}
            self.assertEqual("matcher of what is left" in models, is_there, arguments)

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
            if row["median"] == "computed wrongly":
                self.assertEqual(row["precision"], "bf16")
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
    main(__doc__)
