"""Compares networks on homographies between views of places that none was trained on.

    python -m deepuav_training.evaluate --labels configs/labels.yaml --models a.onnx b.onnx
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from deepuav_training.config import load_config
from deepuav_training.data.homography import (HomographyConfig, sample_homography,
                                              similarity_matrix, translation_matrix, warp_image)
from deepuav_training.data.manifest import Photograph, read_manifest, split_photographs
from deepuav_training.data.photometric import PhotometricConfig, change_light, degrade
from deepuav_training.data.views import load_grey
from deepuav_training.errors import telling_errors
from deepuav_training.keypoints import CELL
from deepuav_training.label import LabelConfig
from deepuav_training.methods import Method, MethodOptions, nearest_methods
from deepuav_training.metrics import (area_under_curve, homography_error, precision,
                                      repeatability)

SETS = ("easy", "hard", "turned 90", "turned 180")
_LIMITS_PX = (1.0, 3.0, 5.0)
_MATCH_PX = 3.0
_NEIGHBOUR_PX = 10.0  # a wrong match within this is of the right place, but of another point

_EASY = HomographyConfig(rotation_deg=15, any_rotation_share=0, scale_min=0.8, scale_max=1.25,
                         perspective=0.15, translation=0.05)
_HARD = HomographyConfig(rotation_deg=45, any_rotation_share=0, scale_min=0.5, scale_max=2.0,
                         perspective=0.25, translation=0.1)
_MILD_LIGHT = PhotometricConfig(exposure=0.2, contrast=0.2, gamma=0.2)
_STRONG_LIGHT = PhotometricConfig(clean_share=0, light_share=1, shadow_share=0.5, haze_share=0.3)


@dataclass(frozen=True)
class Pair:
    """Two views of a photograph."""

    a: np.ndarray  # (H, W) uint8
    b: np.ndarray
    b_from_a: np.ndarray  # (3, 3)


def held_out(labels: LabelConfig, count: int, seed: int) -> list[Photograph]:
    """Photographs of validation places, the sources taking turns."""
    _, validation = split_photographs(read_manifest(labels.images), labels.split)
    rng = np.random.default_rng(seed)
    by_source = {}
    for photo in validation:
        by_source.setdefault(photo.source, []).append(photo)
    queues = [[photos[i] for i in rng.permutation(len(photos))]
              for _, photos in sorted(by_source.items())]
    turns = (queue[turn] for turn in range(max(map(len, queues))) for queue in queues
             if turn < len(queue))
    return [photo for photo, _ in zip(turns, range(count), strict=False)]


def make_pair(photo: np.ndarray, kind: str, rng: np.random.Generator) -> Pair:
    """A pair of the set `kind`; both views have the photograph's size, cut to whole cells."""
    height, width = (CELL * (side // CELL) for side in photo.shape)
    a = np.ascontiguousarray(photo[:height, :width])
    if kind.startswith("turned"):
        centre = np.array([0.5 * (width - 1), 0.5 * (height - 1)])
        turn = (translation_matrix(centre)
                @ similarity_matrix(np.radians(float(kind.split()[1])), 1.0)
                @ translation_matrix(-centre))
        b_from_a = sample_homography(rng, _EASY, width, height) @ turn
    else:
        b_from_a = sample_homography(rng, _HARD if kind == "hard" else _EASY, width, height)
    b, _ = warp_image(photo, b_from_a, width, height)
    if kind == "hard":
        b = degrade(b, rng, _STRONG_LIGHT)
    else:
        picture = change_light(b.astype(np.float32) / 255, rng, _MILD_LIGHT)
        b = np.rint(255 * picture).astype(np.uint8)
    return Pair(a, b, b_from_a)


def measure(method: Method, pairs: list[Pair], estimators: tuple = ("lo-ransac",)
            ) -> dict[str, dict[str, float]]:
    """Percentages over the pairs of one set, by estimator of the homography."""
    errors = {name: [] for name in estimators}
    precisions, placed, repeated, counts, matched = [], [], [], [], []
    for pair in pairs:
        seen_a, seen_b = method.extract_a(pair.a), method.extract_b(pair.b)
        matches = method.match(seen_a, seen_b)
        a, b = seen_a.points[matches[:, 0]], seen_b.points[matches[:, 1]]
        size = seen_a.size
        for name, found in errors.items():
            found.append(homography_error(a, b, pair.b_from_a, *size, name))
        precisions.append(precision(a, b, pair.b_from_a, _MATCH_PX))
        placed.append(precision(a, b, pair.b_from_a, _NEIGHBOUR_PX))
        repeated.append(repeatability(seen_a.points, seen_b.points, pair.b_from_a, size, size,
                                      _MATCH_PX))
        counts.append(len(seen_a.points))
        matched.append(len(matches))
    shared = {"precision": 100 * float(np.mean(precisions)),
              f"precision at {_NEIGHBOUR_PX:g} px": 100 * float(np.mean(placed)),
              "repeatability": 100 * float(np.mean(repeated)),
              "points": float(np.mean(counts)), "matches": float(np.mean(matched))}
    return {name: shared | {f"AUC@{limit:g}": 100 * area_under_curve(found, limit)
                            for limit in _LIMITS_PX} for name, found in errors.items()}


def measure_sets(method: Method, labels: LabelConfig, photos: list[Photograph], seed: int,
                 estimators: tuple = ("lo-ransac",)) -> dict[str, dict[str, dict[str, float]]]:
    """By estimator, the figures of each set, of one pair a photograph."""
    results = {name: {} for name in estimators}
    for number, kind in enumerate(SETS):
        pairs = [make_pair(load_grey(Path(labels.images) / photo.file), kind,
                           np.random.default_rng([seed, number, i]))
                 for i, photo in enumerate(photos)]
        for name, figures in measure(method, pairs, estimators).items():
            results[name][kind] = figures
    return results


def format_set(r: dict[str, float]) -> str:
    """A set's cell of the table: AUC@1/3/5, precision (P), repeatability (R) and points (N)."""
    return (f"{r['AUC@1']:.0f}/{r['AUC@3']:.0f}/{r['AUC@5']:.0f}, P {r['precision']:.0f}, "
            f"R {r['repeatability']:.0f}, N {r['points']:.0f}")


def format_row(name: str, result: dict[str, dict[str, float]]) -> str:
    """A line of the table of all sets."""
    return f"| {name} | " + " | ".join(format_set(result[kind]) for kind in SETS) + " |"


def add_method_arguments(parser: argparse.ArgumentParser) -> None:
    """What names the methods and their options."""
    parser.add_argument("--models", nargs="+", required=True, metavar="FILE[+FILE]",
                        help="networks; with a + the second sees the second view")
    parser.add_argument("--superglue", nargs="*", default=[], metavar="FILE",
                        help="matchers, besides nearest neighbours")
    parser.add_argument("--min-score", type=float, default=0.2,
                        help="least probability of those matchers' matches (%(default)s)")
    parser.add_argument("--points", type=int, default=1024, help="at most (%(default)s)")
    parser.add_argument("--threshold", type=float, default=0.005)
    parser.add_argument("--faint-points", type=int, default=MethodOptions.faint_points,
                        help="of an image with fewer above the threshold (%(default)s)")
    parser.add_argument("--precision", default="f32", choices=("f32", "bf16"))
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--json", type=Path, help="where to write the figures too")


def methods_of(arguments: argparse.Namespace) -> list[Method]:
    """The methods that add_method_arguments' arguments name."""
    options = MethodOptions(arguments.points, arguments.threshold, arguments.precision,
                            arguments.threads, faint_points=arguments.faint_points)
    return nearest_methods(arguments.models, arguments.superglue, arguments.min_score, options)


@telling_errors
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--labels", required=True, help="configuration of the labels: the split")
    parser.add_argument("--pairs", type=int, default=60, help="of a set (%(default)s)")
    add_method_arguments(parser)
    arguments = parser.parse_args()
    cv2.setNumThreads(arguments.threads)
    labels = load_config(LabelConfig, arguments.labels)
    photos = held_out(labels, arguments.pairs, arguments.seed)
    print(f"{len(photos)} pairs a set, at most {arguments.points} points above "
          f"{arguments.threshold} (SuperPoint: fainter ones up to {arguments.faint_points}), "
          f"LO-RANSAC, {arguments.precision}; "
          "AUC@1/3/5 px, precision (P) and repeatability (R) at 3 px, points (N)\n")
    print(f"| network | {' | '.join(SETS)} |\n|---{'|---' * len(SETS)}|", flush=True)
    results = {}
    for method in methods_of(arguments):
        results[method.name] = measure_sets(method, labels, photos, arguments.seed)["lo-ransac"]
        print(format_row(method.name, results[method.name]), flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
