"""Compares networks by the relative poses that their matches give on image sequences.

    python -m deepuav_training.evaluate_poses --models a.onnx --sequences EUROC TUM@535

The number after @ replaces the sequence's focal length. Nothing here is ever trained on.
"""

import argparse
import functools
import json
from pathlib import Path

import cv2
import numpy as np
import poselib

from deepuav_training.data.sequences import Sequence, load_undistorted, read_sequence
from deepuav_training.errors import telling_errors
from deepuav_training.evaluate import add_method_arguments, methods_of
from deepuav_training.methods import Extractor, Method
from deepuav_training.metrics import area_under_curve
from deepuav_training.runtime import Features

_GAPS = (5, 10, 20, 40)  # frames between the two of a pair
LIMITS_DEG = (5.0, 10.0, 20.0)
_LEAST_BASELINE_M = 0.03
_LARGEST_TURN_DEG = 50.0
_INLIER_PX = 1.5
_ITERATIONS = 10000
_OPENCV_ITERATIONS = 1000  # each takes many times as long as one of PoseLib
_CONFIDENCE = 0.9999
_FARTHEST = 1e6  # baselines to a point that still tells in front from behind


def rotation_angle_deg(rotation: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip(0.5 * (np.trace(rotation) - 1), -1, 1))))


def angle_deg(a: np.ndarray, b: np.ndarray) -> float:
    """Between two directions."""
    cosine = a @ b / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-12)
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def choose_pairs(sequence: Sequence, count: int, seed: int) -> list[tuple[int, int]]:
    """Pairs of frames with a baseline, as many of each gap."""
    rng = np.random.default_rng(seed)
    chosen = []
    for gap in _GAPS:
        possible = []
        for i in range(len(sequence.files) - gap):
            b_from_a = relative_pose(sequence, i, i + gap)
            if (np.linalg.norm(b_from_a[:3, 3]) >= _LEAST_BASELINE_M
                    and rotation_angle_deg(b_from_a[:3, :3]) <= _LARGEST_TURN_DEG):
                possible.append((i, i + gap))
        order = rng.permutation(len(possible))[: count // len(_GAPS)]
        chosen += [possible[k] for k in order]
    return sorted(chosen)


def relative_pose(sequence: Sequence, a: int, b: int) -> np.ndarray:
    """b_from_a (4, 4)."""
    return np.linalg.inv(sequence.world_from_camera[b]) @ sequence.world_from_camera[a]


def pose_error_deg(points_a: np.ndarray, points_b: np.ndarray, camera_matrix: np.ndarray,
                   b_from_a: np.ndarray, estimator: str = "lo-ransac") -> float:
    """The larger of the errors of rotation and of translation's direction; inf if none is found.

    `estimator` is "lo-ransac" (PoseLib) or "ransac" (OpenCV).
    """
    if len(points_a) < 5:
        return np.inf
    find = _opencv_pose if estimator == "ransac" else _poselib_pose
    pose = find(points_a.astype(np.float64), points_b.astype(np.float64), camera_matrix)
    if pose is None:
        return np.inf
    rotation, translation = pose
    return max(rotation_angle_deg(rotation @ b_from_a[:3, :3].T),
               angle_deg(translation, b_from_a[:3, 3]))


def _poselib_pose(a: np.ndarray, b: np.ndarray, k: np.ndarray
                  ) -> tuple[np.ndarray, np.ndarray] | None:
    camera = {"model": "PINHOLE", "width": int(2 * k[0, 2]) + 1, "height": int(2 * k[1, 2]) + 1,
              "params": [k[0, 0], k[1, 1], k[0, 2], k[1, 2]]}
    pose, info = poselib.estimate_relative_pose(
        a, b, camera, camera,
        {"max_epipolar_error": _INLIER_PX, "max_iterations": _ITERATIONS, "seed": 0})
    return (pose.R, np.asarray(pose.t)) if info["num_inliers"] >= 5 else None


def _opencv_pose(a: np.ndarray, b: np.ndarray, k: np.ndarray
                 ) -> tuple[np.ndarray, np.ndarray] | None:
    cv2.setRNGSeed(0)
    essential, inliers = cv2.findEssentialMat(a, b, k, cv2.RANSAC, _CONFIDENCE, _INLIER_PX,
                                              _OPENCV_ITERATIONS)
    if essential is None or essential.shape != (3, 3):
        return None
    count, rotation, translation, _, _ = cv2.recoverPose(essential, a, b, k, mask=inliers,
                                                         distanceThresh=_FARTHEST)
    return (rotation, translation[:, 0]) if count >= 5 else None


def measure_poses(method: Method, sequence: Sequence, pairs: list[tuple[int, int]],
                  long_side: int, estimators: tuple = ("lo-ransac",)
                  ) -> dict[str, dict[str, float | list[float]]]:
    """AUC of the pose error in per cent, and each pair's error, by estimator of the pose."""

    @functools.lru_cache(maxsize=256)
    def seen(index: int, extract: Extractor) -> tuple[Features, np.ndarray]:
        image, matrix = load_undistorted(sequence, index, long_side)
        return extract(image), matrix

    errors, matched = {name: [] for name in estimators}, []
    for a, b in pairs:
        seen_a, matrix = seen(a, method.extract_a)
        seen_b, _ = seen(b, method.extract_b)
        matches = method.match(seen_a, seen_b)
        matched.append(len(matches))
        matched_a, matched_b = seen_a.points[matches[:, 0]], seen_b.points[matches[:, 1]]
        for name, found in errors.items():
            found.append(pose_error_deg(matched_a, matched_b, matrix,
                                        relative_pose(sequence, a, b), name))
    return {name: {f"AUC@{limit:g}": 100 * area_under_curve(found, limit)
                   for limit in LIMITS_DEG}
            | {"matches": float(np.mean(matched)), "errors_deg": found}
            for name, found in errors.items()}


def read_sequences(texts: list[str]) -> dict[str, Sequence]:
    """Sequences FOLDER or FOLDER@FOCAL_PX by the folder's name."""
    sequences = {}
    for text in texts:
        folder, _, focal = text.partition("@")
        sequences[Path(folder).name] = read_sequence(folder, float(focal) if focal else None)
    return sequences


def format_cell(result: dict[str, float]) -> str:
    """AUC@5/10/20 and the mean number of matches."""
    return (f"{result['AUC@5']:.0f}/{result['AUC@10']:.0f}/{result['AUC@20']:.0f} "
            f"({result['matches']:.0f})")


@telling_errors
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sequences", nargs="+", required=True, metavar="FOLDER[@FOCAL_PX]")
    parser.add_argument("--pairs", type=int, default=200, help="of a sequence (%(default)s)")
    parser.add_argument("--long-side", type=int, default=640, help="pixels (%(default)s)")
    add_method_arguments(parser)
    arguments = parser.parse_args()
    cv2.setNumThreads(arguments.threads)
    sequences = read_sequences(arguments.sequences)
    print(f"| pose AUC@5/10/20 (matches) | {' | '.join(sequences)} |")
    print("|---" * (1 + len(sequences)) + "|", flush=True)
    results = {}
    for method in methods_of(arguments):
        results[method.name] = {
            name: measure_poses(method, sequence,
                                choose_pairs(sequence, arguments.pairs, arguments.seed),
                                arguments.long_side)["lo-ransac"]
            for name, sequence in sequences.items()}
        cells = map(format_cell, results[method.name].values())
        print(f"| {method.name} | {' | '.join(cells)} |", flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
