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
from deepuav_training.evaluate import features
from deepuav_training.keypoints import DetectionConfig
from deepuav_training.metrics import area_under_curve, mutual_nearest
from deepuav_training.runtime import Network

_GAPS = (5, 10, 20, 40)  # frames between the two of a pair
_LIMITS_DEG = (5.0, 10.0, 20.0)
_LEAST_BASELINE_M = 0.03
_LARGEST_TURN_DEG = 50.0
_INLIER_PX = 1.5


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
                   b_from_a: np.ndarray) -> float:
    """The larger of the errors of rotation and of translation's direction; inf if none is found."""
    if len(points_a) < 5:
        return np.inf
    k = camera_matrix
    camera = {"model": "PINHOLE", "width": int(2 * k[0, 2]) + 1, "height": int(2 * k[1, 2]) + 1,
              "params": [k[0, 0], k[1, 1], k[0, 2], k[1, 2]]}
    pose, info = poselib.estimate_relative_pose(
        points_a.astype(np.float64), points_b.astype(np.float64), camera, camera,
        {"max_epipolar_error": _INLIER_PX, "max_iterations": 10000, "seed": 0})
    if info["num_inliers"] < 5:
        return np.inf
    return max(rotation_angle_deg(pose.R @ b_from_a[:3, :3].T),
               angle_deg(np.asarray(pose.t), b_from_a[:3, 3]))


def measure_poses(network: Network, sequence: Sequence, pairs: list[tuple[int, int]],
                  detection: DetectionConfig, long_side: int) -> dict[str, float]:
    """AUC of the pose error in per cent."""

    @functools.lru_cache(maxsize=256)
    def seen(index: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        image, matrix = load_undistorted(sequence, index, long_side)
        return *features(network, image, detection), matrix

    errors, matched = [], []
    for a, b in pairs:
        points_a, descriptors_a, matrix = seen(a)
        points_b, descriptors_b, _ = seen(b)
        matches = mutual_nearest(descriptors_a, descriptors_b)
        matched.append(len(matches))
        errors.append(pose_error_deg(points_a[matches[:, 0]], points_b[matches[:, 1]], matrix,
                                     relative_pose(sequence, a, b)))
    result = {f"AUC@{limit:g}": 100 * area_under_curve(errors, limit) for limit in _LIMITS_DEG}
    return result | {"matches": float(np.mean(matched))}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--models", nargs="+", required=True)
    parser.add_argument("--sequences", nargs="+", required=True, metavar="FOLDER[@FOCAL_PX]")
    parser.add_argument("--pairs", type=int, default=200, help="of a sequence (%(default)s)")
    parser.add_argument("--points", type=int, default=1024, help="at most (%(default)s)")
    parser.add_argument("--threshold", type=float, default=0.005)
    parser.add_argument("--long-side", type=int, default=640, help="pixels (%(default)s)")
    parser.add_argument("--precision", default="f32", choices=("f32", "bf16"))
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--json", type=Path, help="where to write the figures too")
    arguments = parser.parse_args()
    cv2.setNumThreads(arguments.threads)
    detection = DetectionConfig(max_points=arguments.points, threshold=arguments.threshold)
    sequences = {}
    for text in arguments.sequences:
        folder, _, focal = text.partition("@")
        sequences[Path(folder).name] = read_sequence(folder, float(focal) if focal else None)
    print(f"| pose AUC@5/10/20 (matches) | {' | '.join(sequences)} |")
    print("|---" * (1 + len(sequences)) + "|", flush=True)
    results = {}
    for model in arguments.models:
        network = Network(model, arguments.threads, arguments.precision)
        results[model] = {
            name: measure_poses(network, sequence,
                                choose_pairs(sequence, arguments.pairs, arguments.seed), detection,
                                arguments.long_side)
            for name, sequence in sequences.items()}
        cells = [f"{r['AUC@5']:.0f}/{r['AUC@10']:.0f}/{r['AUC@20']:.0f} ({r['matches']:.0f})"
                 for r in results[model].values()]
        print(f"| {Path(model).stem} | {' | '.join(cells)} |", flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
