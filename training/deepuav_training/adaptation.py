"""Homographic adaptation: a teacher's key points made repeatable by voting over many views.

DeTone, Malisiewicz and Rabinovich, "SuperPoint", 2018, section 5. Instead of averaging warped
probability maps, each view votes with its sub-pixel points, so that positions stay finer than the
pixel grid.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from deepuav_training.config import check_field
from deepuav_training.data.homography import (HomographyConfig, inside, sample_homography,
                                              warp_image, warp_points)
from deepuav_training.keypoints import (DetectionConfig, detect, probability_map,
                                        sample_descriptors)
from deepuav_training.label_cache import Labels

Teacher = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class AdaptationConfig:
    """How the views' votes are gathered."""

    homographies: int = 10  # views besides the image itself; the paper uses about 100
    homography: HomographyConfig = field(default_factory=lambda: HomographyConfig(
        rotation_deg=45, any_rotation_share=0.3, scale_min=0.7, scale_max=1.6, perspective=0.2,
        translation=0.1))
    view_threshold: float = 0.002  # least probability of a point that votes
    vote_sigma: float = 0.9  # pixels over which a vote spreads
    max_points: int = 512
    min_mass: float = 0.02  # least certainty of a label
    border: int = 6  # pixels at a view's edge that neither vote nor are counted

    def check(self, where: str) -> None:
        check_field(self.homographies >= 0, where, "homographies", self.homographies,
                    "at least 0")
        check_field(0 < self.view_threshold < 1, where, "view_threshold", self.view_threshold,
                    "a value in (0, 1)")
        check_field(self.vote_sigma > 0, where, "vote_sigma", self.vote_sigma, "positive")
        check_field(self.border >= 5, where, "border", self.border, "at least 5 pixels")


def adapt(image: np.ndarray, teacher: Teacher, config: AdaptationConfig, rng: np.random.Generator
          ) -> Labels:
    """Labels one view of a photograph.

    Args:
        image: (H, W) uint8, sides multiples of 8.
        teacher: the network: image (H, W) -> logits (65, h, w), descriptors (C, h, w).
    """
    height, width = image.shape
    votes = np.zeros((height, width), np.float32)
    seen = np.zeros((height, width), np.float32)
    views = []
    for k in range(config.homographies + 1):
        view_from_image = (np.eye(3) if k == 0 else
                           sample_homography(rng, config.homography, width, height))
        view, _ = warp_image(image, view_from_image, width, height)
        logits, descriptors = teacher(view)
        points, mass = _view_points(probability_map(logits), config)
        seen += _visible(view_from_image, width, height, config.border)
        _cast_votes(votes, warp_points(np.linalg.inv(view_from_image), points), mass,
                    config.vote_sigma)
        views.append((view_from_image, descriptors))
    points, mass = _elect(votes / np.maximum(seen, 1.0), config)
    return Labels(points, mass, _mean_descriptors(points, views, width, height, config.border))


def _view_points(probability: np.ndarray, config: AdaptationConfig
                 ) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 2) of one view and the probability mass around each (N,), at most 1."""
    detection = DetectionConfig(max_points=4 * config.max_points, threshold=config.view_threshold,
                                border=config.border)
    points, _ = detect(probability, detection)
    mass = cv2.boxFilter(probability, -1, (5, 5), normalize=False)
    nearest = np.rint(points).astype(int)
    return points, np.minimum(mass[nearest[:, 1], nearest[:, 0]], 1.0)


def _visible(view_from_image: np.ndarray, width: int, height: int, border: int) -> np.ndarray:
    """(H, W) float32, 1 where the image's pixel lies well inside the view."""
    frame = np.zeros((height, width), np.float32)
    frame[border:-border, border:-border] = 1
    return cv2.warpPerspective(frame, view_from_image, (width, height),
                               flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP)


def _cast_votes(votes: np.ndarray, points: np.ndarray, mass: np.ndarray, sigma: float) -> None:
    """Adds a Gaussian of peak `mass` around each point to `votes` (H, W)."""
    height, width = votes.shape
    reach = int(np.ceil(3 * sigma))
    keep = inside(points, width, height, reach)
    points, mass = points[keep], mass[keep]
    nearest = np.rint(points).astype(int)
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            offset = nearest + (dx, dy) - points
            value = mass * np.exp(-0.5 * (offset**2).sum(axis=1) / sigma**2)
            np.add.at(votes, (nearest[:, 1] + dy, nearest[:, 0] + dx), value.astype(np.float32))


def _elect(certainty: np.ndarray, config: AdaptationConfig) -> tuple[np.ndarray, np.ndarray]:
    """Peaks (N, 2) of the mean votes (H, W) and their certainty (N,), at most 1."""
    detection = DetectionConfig(max_points=config.max_points, threshold=config.min_mass,
                                suppression_radius=3, border=config.border, smoothing_sigma=0.5)
    points, mass = detect(certainty, detection)
    return points, np.minimum(mass, 1.0)


def _mean_descriptors(points: np.ndarray, views: list, width: int, height: int, border: int
                      ) -> np.ndarray:
    """Unit means (N, C) of the points' descriptors over the views that see them."""
    total = np.zeros((len(points), views[0][1].shape[0]), np.float32)
    for view_from_image, descriptors in views:
        projected = warp_points(view_from_image, points)
        visible = inside(projected, width, height, border)
        total[visible] += sample_descriptors(descriptors, projected[visible])
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-6)


def without_voting(config: AdaptationConfig) -> AdaptationConfig:
    """The same settings for the teacher's plain output on the image itself."""
    return replace(config, homographies=0)
