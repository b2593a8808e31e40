"""Training samples: a labelled view and a warped copy, both degraded, with what is true of both."""

import functools
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from deepuav_training.config import check_field
from deepuav_training.data.homography import (HomographyConfig, inside, sample_homography,
                                              warp_image, warp_points)
from deepuav_training.data.photometric import PhotometricConfig, degrade
from deepuav_training.data.views import View, ViewConfig, load_grey
from deepuav_training.errors import TrainingError
from deepuav_training.keypoints import CELL
from deepuav_training.label_cache import Labels, label_path, load_labels


@dataclass(frozen=True)
class PairConfig:
    """How a sample is drawn from a labelled view."""

    homography: HomographyConfig = field(default_factory=HomographyConfig)
    photometric: PhotometricConfig = field(default_factory=PhotometricConfig)
    points: int = 192  # correspondences of a sample, at most
    label_sigma: float = 0.6  # pixels over which a label spreads
    label_border: int = 6  # pixels at a view's edge without labels

    def check(self, where: str) -> None:
        check_field(self.points > 1, where, "points", self.points, "at least 2")
        check_field(self.label_sigma > 0, where, "label_sigma", self.label_sigma, "positive")


@dataclass(frozen=True)
class Sample:
    """One pair; index 0 is the labelled view, 1 its warped copy or another view of the scene."""

    images: np.ndarray  # (2, H, W) uint8
    cells: np.ndarray  # (2, 65, H/8, W/8) float32: probabilities of the cells' pixels and none
    known: np.ndarray  # (2, H/8, W/8) bool: cells whose labels are known
    nearest: np.ndarray  # (2, H, W) int32: number of the labelled point that is nearest to a pixel
    points: np.ndarray  # (2, K, 2) float32, corresponding points; rows beyond `count` are zero
    descriptors: np.ndarray  # (K, C) float32, the teacher's
    count: int


class PairSource:
    """Draws samples; sample (step, k) depends on the seed and these numbers alone."""

    def __init__(self, views: list[View], images: str | Path, labels: str | Path,
                 view_config: ViewConfig, config: PairConfig, seed: int):
        """`images` is the photographs' root, `labels` the cache's folder."""
        self._views = [view for view in views if label_path(labels, view.index).exists()]
        if not self._views:
            raise TrainingError(f"{labels}: holds labels of none of {len(views)} views: expected "
                                "those that python -m deepuav_training.label --config CONFIG makes")
        self._labels, self._config, self._seed = Path(labels), config, seed
        self._width, self._height = view_config.width, view_config.height
        self._photo = functools.cache(lambda file: load_grey(Path(images) / file))

    def __len__(self) -> int:
        return len(self._views)

    def draw(self, number: int) -> Sample:
        """The sample of this running number: every view once, then all again in a new order."""
        epoch, place = divmod(number, len(self._views))
        order = np.random.default_rng([self._seed, epoch]).permutation(len(self._views))
        rng = np.random.default_rng([self._seed, epoch, place])
        view = self._views[order[place]]
        labels = load_labels(label_path(self._labels, view.index))
        return self._make(view, labels, rng)

    def _make(self, view: View, labels: Labels, rng: np.random.Generator) -> Sample:
        c, width, height = self._config, self._width, self._height
        b_from_a = sample_homography(rng, c.homography, width, height)
        photo = self._photo(view.photograph.file)
        homographies = (np.eye(3), b_from_a)
        images = [degrade(warp_image(photo, h @ view.view_from_photo, width, height)[0], rng,
                          c.photometric) for h in homographies]
        points = [warp_points(h, labels.points.astype(np.float64)) for h in homographies]
        known = [known_cells(h, width, height, c.label_border) for h in homographies]
        return make_sample(images, points, known, labels, rng, c)


def make_sample(images: list[np.ndarray], points: list[np.ndarray], known: list[np.ndarray],
                labels: Labels, rng: np.random.Generator, config: PairConfig) -> Sample:
    """The sample of two images (H, W), given where each shows the labelled points, (N, 2) with NaN
    where it does not, and which of its cells (H/8, W/8) the labels cover."""
    height, width = images[0].shape
    cells = [cell_labels(p, labels.mass, width, height, config.label_sigma) for p in points]
    nearest = [nearest_points(p, width, height) for p in points]
    both = np.flatnonzero(inside(points[0], width, height, config.label_border)
                          & inside(points[1], width, height, config.label_border))
    chosen = rng.permutation(both)[: config.points]
    pair = np.zeros((2, config.points, 2), np.float32)
    pair[:, : len(chosen)] = np.stack(points)[:, chosen]
    descriptors = np.zeros((config.points, labels.descriptors.shape[1]), np.float32)
    descriptors[: len(chosen)] = labels.descriptors[chosen]
    return Sample(np.stack(images), np.stack(cells), np.stack(known), np.stack(nearest), pair,
                  descriptors, len(chosen))


def cell_labels(points: np.ndarray, mass: np.ndarray, width: int, height: int, sigma: float
                ) -> np.ndarray:
    """Spreads each point's mass over the pixels around it and folds them into cells.

    Args:
        points: (N, 2) in pixels; those outside, or NaN, are left out.
        mass: (N,) probability that a point is there.
        sigma: of the Gaussian, pixels.

    Returns:
        (65, H/8, W/8) float32; every cell's sum is 1, the last channel is "no point".
    """
    keep = inside(points, width, height, 1.0)
    points, mass = points[keep], mass[keep]
    reach = int(np.ceil(2.5 * sigma))
    steps = np.arange(-reach, reach + 1)
    nearest = np.rint(points).astype(np.int64)
    offset = nearest[:, :, None] + steps - points[:, :, None]
    weight = np.exp(-0.5 * (offset / sigma) ** 2)
    weight /= weight.sum(axis=2, keepdims=True)
    x, y = nearest[:, 0, None] + steps, nearest[:, 1, None] + steps
    value = mass[:, None, None] * weight[:, 1, :, None] * weight[:, 0, None, :]
    valid = ((y >= 0) & (y < height))[:, :, None] & ((x >= 0) & (x < width))[:, None, :]
    index = (y[:, :, None] * width + x[:, None, :])
    heat = np.bincount(index[valid], value[valid], height * width)
    rows, columns = height // CELL, width // CELL
    cells = heat.reshape(rows, CELL, columns, CELL).transpose(1, 3, 0, 2).reshape(-1, rows, columns)
    total = cells.sum(axis=0)
    cells = cells / np.maximum(total, 1.0)
    nothing = np.maximum(1.0 - total, 0.0)
    return np.concatenate([cells, nothing[None]]).astype(np.float32)


def nearest_points(points: np.ndarray, width: int, height: int) -> np.ndarray:
    """(H, W) int32: a number for each pixel, equal for those that have the same point as nearest.

    Points (N, 2) in pixels; those outside, or NaN, are left out, and those that share a pixel are
    one.
    """
    columns, rows = np.rint(points[inside(points, width, height)]).astype(int).T
    empty = np.ones((height, width), np.uint8)
    empty[rows, columns] = 0
    return cv2.distanceTransformWithLabels(empty, cv2.DIST_L2, cv2.DIST_MASK_5,
                                           labelType=cv2.DIST_LABEL_PIXEL)[1]


def known_cells(view_from_labelled: np.ndarray, width: int, height: int, border: int
                ) -> np.ndarray:
    """(H/8, W/8) bool: cells that lie within the labelled view, wholly and off its border."""
    rows, columns = height // CELL, width // CELL
    labelled_from_view = np.linalg.inv(view_from_labelled)
    known = np.ones((rows, columns), bool)
    for dx in (0, CELL - 1):
        for dy in (0, CELL - 1):
            x, y = np.meshgrid(np.arange(columns) * CELL + dx, np.arange(rows) * CELL + dy)
            corners = np.stack([x.ravel(), y.ravel()], axis=1).astype(np.float64)
            labelled = warp_points(labelled_from_view, corners)
            known &= inside(labelled, width, height, border).reshape(rows, columns)
    return known
