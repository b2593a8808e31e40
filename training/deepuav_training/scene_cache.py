"""Features of scenes on disk: extracted once, then drawn from in many pairs.

A scene is one small file, written whole or not at all.
"""

import os
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deepuav_training.data.scenes import Scene
from deepuav_training.errors import TrainingError
from deepuav_training.keypoints import DetectionConfig
from deepuav_training.runtime import Network, extract

_DESCRIPTOR_SCALE = 127.0 / 0.5  # entries of unit vectors of many dimensions are small


@dataclass(frozen=True)
class SceneFeatures:
    """V views of a scene with K key points each, the best first."""

    points: np.ndarray  # (V, K, 2) float32, pixels
    scores: np.ndarray  # (V, K) float32
    descriptors: np.ndarray  # (V, K, C) float32 of length 1; int8, of any length, where loaded
    seen_at: np.ndarray  # (V, V, K, 2) float32: where view [1] shows the points of view [0], or NaN
    size: np.ndarray  # (2,) int32: width and height of the views, pixels


def extract_scene(scene: Scene, network: Network, detection: DetectionConfig
                  ) -> SceneFeatures | None:
    """Features of all views, or None if one has fewer key points than `detection` asks for."""
    views = [extract(network, image, detection) for image in scene.images]
    if min(len(view.points) for view in views) < detection.max_points:
        return None
    seen_at = [[scene.transfer(a.points.astype(np.float64), i, j) for j in range(len(views))]
               for i, a in enumerate(views)]
    return SceneFeatures(np.stack([view.points for view in views]),
                         np.stack([view.scores for view in views]),
                         np.stack([view.descriptors for view in views]),
                         np.array(seen_at, np.float32), np.array(views[0].size, np.int32))


def scene_path(folder: str | Path, index: int) -> Path:
    """The file of scene `index`."""
    return Path(folder) / f"{index // 1000:03d}" / f"{index:06d}.npz"


def cached_scenes(folder: str | Path, count: int, made_by: str) -> list[Path]:
    """The files of scenes 0 to count - 1 that exist; `made_by` is the command that makes them.

    Raises:
        TrainingError: there is none.
    """
    found = [path for index in range(count) if (path := scene_path(folder, index)).exists()]
    if not found:
        raise TrainingError(f"{folder}: found no scenes, expected those of {made_by}")
    return found


def save_scene(path: Path, scene: SceneFeatures) -> None:
    """Writes a scene: positions as they are, descriptors in 8 bits."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(f".partial{os.getpid()}")
    steps = np.clip(np.rint(scene.descriptors * _DESCRIPTOR_SCALE), -127, 127)
    with partial.open("wb") as stream:
        np.savez(stream, points=scene.points, scores=scene.scores,
                 descriptors=steps.astype(np.int8), seen_at=scene.seen_at, size=scene.size)
    partial.replace(path)


def load_scene(path: Path) -> SceneFeatures:
    """Reads what save_scene wrote."""
    try:
        with np.load(path) as archive:
            return SceneFeatures(*(archive[name] for name in (
                "points", "scores", "descriptors", "seen_at", "size")))
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise TrainingError(f"{path}: cannot be read as a scene: {error}") from error
