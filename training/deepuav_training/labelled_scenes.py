"""Clean views of rendered scenes on disk, with the teacher's labels of each.

A scene is one file, written whole or not at all.
"""

import os
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deepuav_training.data.scenes import Scene
from deepuav_training.errors import TrainingError
from deepuav_training.keypoints import CELL, unit_descriptors
from deepuav_training.label_cache import DESCRIPTOR_SCALE, Labels

_CORNER = (0.0, 0.5 * (CELL - 1), CELL - 1.0)  # pixels of a cell that must all be seen


@dataclass(frozen=True)
class LabelledScene:
    """V views of one place."""

    images: np.ndarray  # (V, H, W) uint8, not degraded
    labels: list[Labels]  # of each view, N_v points
    # [a][b] (N_a, 2) float32: where view b shows the points of view a, NaN where it does not
    seen_at: list[list[np.ndarray]]
    shared: np.ndarray  # (V, V, H/8, W/8) bool, [a, b]: cells of view b that view a shows wholly

    def counts(self) -> np.ndarray:
        """(V, V) points of view [0] that view [1] shows; 0 of a view with itself."""
        return np.array([[0 if a == b else int(np.isfinite(to[:, 0]).sum())
                          for b, to in enumerate(row)] for a, row in enumerate(self.seen_at)])


def relate(scene: Scene, labels: list[Labels], border: int) -> LabelledScene:
    """Finds what the views show of each other; what lies within `border` pixels of an edge of the
    labelled view is not known to it."""
    views = range(len(labels))
    seen_at = [[scene.transfer(labels[a].points.astype(np.float64), a, b).astype(np.float32)
                for b in views] for a in views]
    height, width = scene.images[0].shape
    shared = [[shared_cells(scene, b, a, width, height, border) for b in views] for a in views]
    return LabelledScene(np.stack(scene.images), labels, seen_at, np.array(shared))


def shared_cells(scene: Scene, view: int, labelled: int, width: int, height: int, border: int
                 ) -> np.ndarray:
    """(H/8, W/8) bool: cells of `view` that lie wholly within what `labelled` shows."""
    rows, columns = height // CELL, width // CELL
    shared = np.ones((rows, columns), bool)
    x, y = np.meshgrid(np.arange(columns) * CELL, np.arange(rows) * CELL)
    for dx in _CORNER:
        for dy in _CORNER:
            points = np.stack([x.ravel() + dx, y.ravel() + dy], axis=1)
            at = scene.transfer(points, view, labelled)
            with np.errstate(invalid="ignore"):
                seen = ((at >= border) & (at <= (width - 1 - border, height - 1 - border))).all(axis=1)
            shared &= seen.reshape(rows, columns)
    return shared


def save_labelled_scene(path: Path, scene: LabelledScene) -> None:
    """Writes a scene: positions as they are, descriptors in 8 bits."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(f".partial{os.getpid()}")
    descriptors = np.concatenate([labels.descriptors for labels in scene.labels])
    with partial.open("wb") as stream:
        np.savez(stream, images=scene.images, shared=scene.shared,
                 counts=np.array([len(labels.points) for labels in scene.labels]),
                 points=np.concatenate([labels.points for labels in scene.labels]),
                 mass=np.concatenate([labels.mass for labels in scene.labels]).astype(np.float16),
                 descriptors=np.rint(descriptors * DESCRIPTOR_SCALE).astype(np.int8),
                 seen_at=np.concatenate([np.stack(row, axis=1) for row in scene.seen_at]))
    partial.replace(path)


def load_labelled_scene(path: Path) -> LabelledScene:
    """Reads what save_labelled_scene wrote."""
    try:
        with np.load(path) as archive:
            ends = np.cumsum(archive["counts"])[:-1]
            images, shared = archive["images"], archive["shared"]
            points, mass, seen_at = (np.split(archive[name], ends)
                                     for name in ("points", "mass", "seen_at"))
            descriptors = np.split(archive["descriptors"], ends)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise TrainingError(f"{path}: cannot be read as a labelled scene: {error}") from error
    labels = [Labels(p, m.astype(np.float32), unit_descriptors(d))
              for p, m, d in zip(points, mass, descriptors, strict=True)]
    return LabelledScene(images, labels, [list(rows.transpose(1, 0, 2)) for rows in seen_at], shared)
