"""Teacher labels on disk: one small file a view, written whole or not at all."""

import os
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deepuav_training.errors import TrainingError
from deepuav_training.keypoints import unit_descriptors

DESCRIPTOR_SCALE = 127.0


@dataclass(frozen=True)
class Labels:
    """What the teacher sees in one view."""

    points: np.ndarray  # (N, 2) float32, pixels, sub-pixel, the most certain first
    mass: np.ndarray  # (N,) float32, probability in 0..1 that a point is there
    descriptors: np.ndarray  # (N, C) float32, of length 1


def label_path(folder: str | Path, index: int) -> Path:
    """The file of view `index`."""
    return Path(folder) / f"{index // 1000:03d}" / f"{index:06d}.npz"


def save_labels(path: Path, labels: Labels) -> None:
    """Writes labels: positions as they are, descriptors in 8 bits."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(f".partial{os.getpid()}")
    with partial.open("wb") as stream:
        np.savez(stream, points=labels.points.astype(np.float32),
                 mass=labels.mass.astype(np.float16),
                 descriptors=np.rint(labels.descriptors * DESCRIPTOR_SCALE).astype(np.int8))
    partial.replace(path)


def load_labels(path: Path) -> Labels:
    """Reads what save_labels wrote."""
    try:
        with np.load(path) as archive:
            points, mass = archive["points"], archive["mass"].astype(np.float32)
            descriptors = unit_descriptors(archive["descriptors"])
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise TrainingError(f"{path}: cannot be read as labels: {error}") from error
    return Labels(points, mass, descriptors)
