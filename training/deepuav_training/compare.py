"""The table of all methods: homographies of held-out places, and relative poses on sequences.

    python -m deepuav_training.compare --config configs/comparison.yaml --out comparison

Writes OUT.md and OUT.json; what OUT.json holds already, of the same files and settings, is not measured again.
"""

import argparse
import dataclasses
import hashlib
import json
import logging
from dataclasses import dataclass
from pathlib import Path

import cv2

from deepuav_training.cache_identity import file_digest, photographs_identity
from deepuav_training.config import check_field, from_mapping, load_config
from deepuav_training.errors import telling_errors
from deepuav_training.evaluate import SETS, format_set, held_out, measure_sets
from deepuav_training.evaluate_poses import (LIMITS_DEG, choose_pairs, format_cell,
                                             measure_poses, read_sequences)
from deepuav_training.label import LabelConfig
from deepuav_training.methods import MethodConfig, MethodOptions, build_method
from deepuav_training.metrics import paired_difference

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class ComparisonConfig:
    """What is compared on what."""

    methods: tuple = ()  # mappings, each a MethodConfig
    labels: str = "configs/labels.yaml"  # names the photographs and the places held out
    sequences: tuple = ()  # FOLDER or FOLDER@FOCAL_PX
    homography_pairs: int = 60  # of a set; 0 leaves these sets out
    pose_pairs: int = 200  # of a sequence
    points: tuple = (512, 1024)  # of an image, at most
    estimators: tuple = ("ransac", "lo-ransac")
    threshold: float = 0.005  # least probability of a SuperPoint
    long_side: int = 640  # pixels, of the sequences' images
    seed: int = 11
    threads: int = 1
    precision: str = "f32"
    baseline: str = ""  # the method from which differences in poses are told; "": none

    def check(self, where: str) -> None:
        check_field(len(self.methods) > 0, where, "methods", self.methods, "at least one")
        check_field(self.homography_pairs >= 0, where, "homography_pairs", self.homography_pairs,
                    "0 or more")
        for name in self.estimators:
            check_field(name in ("ransac", "lo-ransac"), where, "estimators", name,
                        "ransac or lo-ransac")

    def method_configs(self, where: str) -> list[MethodConfig]:
        """The methods, checked."""
        found = [from_mapping(MethodConfig, tree, f"{where}: methods") for tree in self.methods]
        names = [method.name for method in found]
        check_field(self.baseline in ("", *names), where, "baseline", self.baseline,
                    f"one of {', '.join(names)}")
        return found


def narrowed(config: ComparisonConfig, only: list[str] | None, baseline: str | None
             ) -> ComparisonConfig:
    """The comparison of the methods named alone, with another baseline; None changes nothing."""
    names = [tree.get("name", "") for tree in config.methods]
    for name in only or ():
        check_field(name in names, "command line", "--only", name, f"some of {', '.join(names)}")
    kept = config.methods if only is None else [m for m in config.methods if m.get("name") in only]
    return dataclasses.replace(config, methods=kept,
                               baseline=config.baseline if baseline is None else baseline)


class Comparison:
    """Measures method by method; figures are kept in a file as they come."""

    def __init__(self, config: ComparisonConfig, kept: Path):
        self._config, self._kept = config, kept
        self._labels = load_config(LabelConfig, config.labels)
        self._photos = held_out(self._labels, config.homography_pairs, config.seed)
        self._sequences = read_sequences(list(config.sequences))
        self._extractors = {}
        self.results = json.loads(kept.read_text()) if kept.exists() else {}

    def measure(self, method_config: MethodConfig, points: int) -> None:
        """Fills in a method's lines of the tables, unless they are there."""
        c = self._config
        keys = {name: line_key(method_config, c, points, name) for name in c.estimators}
        if all(key in self.results for key in keys.values()):
            return
        method = build_method(method_config,
                              MethodOptions(points, c.threshold, c.precision, c.threads,
                                            self._extractors, max(c.points)))
        figures = {name: {} for name in c.estimators}
        if self._photos:
            figures = measure_sets(method, self._labels, self._photos, c.seed, c.estimators)
        for name, sequence in self._sequences.items():
            pairs = choose_pairs(sequence, c.pose_pairs, c.seed)
            poses = measure_poses(method, sequence, pairs, c.long_side, c.estimators)
            for estimator in c.estimators:
                figures[estimator][name] = poses[estimator]
        self.results |= {key: figures[name] for name, key in keys.items()}
        partial = self._kept.with_suffix(".partial")
        partial.write_text(json.dumps(self.results, indent=1))
        partial.replace(self._kept)
        _LOG.info("%s, %d points", method.name, points)

    def table(self, methods: list[MethodConfig], points: int, estimator: str) -> str:
        """Markdown with a line for each method."""
        sets = SETS if self._photos else ()
        columns = [*sets, *self._sequences]
        homographies = ("AUC@1/3/5 px, precision (P) and repeatability (R) at 3 px, points (N); "
                        if sets else "")
        lines = [f"At most {points} points, {estimator.upper()}: {homographies}"
                 "poses AUC@5/10/20 degrees (matches)", "",
                 f"| method | {' | '.join(columns)} |", "|---" * (len(columns) + 1) + "|"]
        for method in methods:
            figures = self.results[line_key(method, self._config, points, estimator)]
            cells = [*map(format_set, map(figures.get, sets)),
                     *(format_cell(figures[name]) for name in self._sequences)]
            lines.append(f"| {method.name} | {' | '.join(cells)} |")
        return "\n".join(lines)

    def difference_table(self, methods: list[MethodConfig], points: int, estimator: str) -> str:
        """Markdown: by how much poses of each method are ahead of the baseline's on the same pairs."""
        c = self._config
        errors = {method.name: {name: self.results[line_key(method, c, points, estimator)][name]
                                ["errors_deg"] for name in self._sequences} for method in methods}
        lines = [f"At most {points} points, {estimator.upper()}: poses beside those of {c.baseline}, "
                 "difference of AUC@5, @10 and @20 (95 % of a paired bootstrap)", "",
                 f"| method | {' | '.join(self._sequences)} |",
                 "|---" * (len(self._sequences) + 1) + "|"]
        for method, of_sequence in errors.items():
            if method == c.baseline:
                continue
            cells = [", ".join(format_difference(paired_difference(
                found, errors[c.baseline][name], limit, c.seed)) for limit in LIMITS_DEG)
                for name, found in of_sequence.items()]
            lines.append(f"| {method} | {' | '.join(cells)} |")
        return "\n".join(lines)


def format_difference(of_areas: tuple[float, float, float]) -> str:
    """Difference, lower and upper bound in per cent."""
    difference, low, high = (100 * value for value in of_areas)
    return f"{difference:+.1f} ({low:+.1f} to {high:+.1f})"


def line_key(method: MethodConfig, config: ComparisonConfig, points: int, estimator: str) -> str:
    """Names a line of the tables in the file of figures, and by a digest what it was measured with."""
    made_of = dataclasses.asdict(method) | {
        name: getattr(config, name) for name in ("sequences", "homography_pairs", "pose_pairs",
                                                 "threshold", "long_side", "seed", "precision")}
    made_of["kept"] = "errors of each pair"
    if method.extractor == "superpoint":
        made_of["faint"] = [MethodOptions.faint_points, MethodOptions.faint_threshold]
    for name in ("model", "second_model", "matcher_model"):
        made_of[name] = file_digest(made_of[name]) if made_of[name] else ""
    labels = load_config(LabelConfig, config.labels)
    made_of |= photographs_identity(labels.images, labels.split)
    digest = hashlib.sha256(json.dumps(made_of, sort_keys=True).encode()).hexdigest()[:16]
    return f"{method.name}, {points} points, {estimator}, {digest}"


@telling_errors
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--config", required=True)
    parser.add_argument("--out", type=Path, required=True, help="without ending")
    parser.add_argument("--only", nargs="+", metavar="METHOD", help="of the configuration")
    parser.add_argument("--baseline", metavar="METHOD", help="in place of the configuration's")
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    config = narrowed(load_config(ComparisonConfig, arguments.config), arguments.only,
                      arguments.baseline)
    cv2.setNumThreads(config.threads)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    methods = config.method_configs(arguments.config)
    comparison = Comparison(config, arguments.out.with_suffix(".json"))
    tables = []
    for points in config.points:
        for method in methods:
            comparison.measure(method, points)
        for estimator in config.estimators:
            tables.append(comparison.table(methods, points, estimator))
            if config.baseline and config.sequences:
                tables.append(comparison.difference_table(methods, points, estimator))
    arguments.out.with_suffix(".md").write_text("\n\n".join(tables) + "\n")
    print("\n\n".join(tables))


if __name__ == "__main__":
    main()
