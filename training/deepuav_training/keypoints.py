"""From a network's output maps to key points and descriptors, in NumPy.

The same steps as the C++ extractor: softmax over 65 cells, non-maximum suppression, sub-pixel
position by a quadratic fit of the logarithm of the smoothed probability, bicubic descriptors.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from deepuav_training.config import check_field

CELL = 8  # pixels along the side of a detector cell
_TINY = 1e-12


@dataclass(frozen=True)
class DetectionConfig:
    """How key points are picked from a probability map."""

    max_points: int = 1024
    threshold: float = 0.005  # least probability of a key point
    suppression_radius: int = 4  # pixels
    border: int = 4  # pixels
    smoothing_sigma: float = 1.0  # pixels, before the sub-pixel fit
    subpixel: bool = True

    def check(self, where: str) -> None:
        check_field(self.max_points > 0, where, "max_points", self.max_points, "at least 1")
        check_field(0 <= self.threshold < 1, where, "threshold", self.threshold, "a value in [0, 1)")
        check_field(self.suppression_radius >= 1, where, "suppression_radius",
                    self.suppression_radius, "at least 1")
        check_field(self.border >= 1, where, "border", self.border, "at least 1")
        check_field(self.smoothing_sigma > 0, where, "smoothing_sigma", self.smoothing_sigma,
                    "a positive number of pixels")


def probability_map(logits: np.ndarray) -> np.ndarray:
    """Softmax over the 65 channels (65, h, w), drop the last, unfold to (8h, 8w) float32."""
    shifted = np.exp(logits - logits.max(axis=0, keepdims=True))
    cells = shifted[:-1] / shifted.sum(axis=0, keepdims=True)
    _, rows, columns = cells.shape
    unfolded = cells.reshape(CELL, CELL, rows, columns).transpose(2, 0, 3, 1)
    return np.ascontiguousarray(unfolded.reshape(rows * CELL, columns * CELL), dtype=np.float32)


def detect(probability: np.ndarray, config: DetectionConfig) -> tuple[np.ndarray, np.ndarray]:
    """Picks the key points of a probability map (H, W), the most probable first.

    Returns:
        Positions (N, 2) float32 in pixels, x then y, and scores (N,) float32.
    """
    size = 2 * config.suppression_radius + 1
    peaks = cv2.dilate(probability, np.ones((size, size), np.uint8))
    mask = (probability == peaks) & (probability > config.threshold)
    b = config.border
    mask[:b], mask[-b:], mask[:, :b], mask[:, -b:] = False, False, False, False
    rows, columns = np.nonzero(mask)
    scores = probability[rows, columns]
    order = np.argsort(-scores, kind="stable")[: config.max_points]
    rows, columns, scores = rows[order], columns[order], scores[order]
    points = np.stack([columns, rows], axis=1).astype(np.float32)
    if config.subpixel:
        points += subpixel_offsets(probability, rows, columns, config.smoothing_sigma)
    return points, scores


def subpixel_offsets(probability: np.ndarray, rows: np.ndarray, columns: np.ndarray, sigma: float
                     ) -> np.ndarray:
    """Offsets (N, 2), x then y, of the maxima of a quadratic fitted to the log of the smoothed map.

    The quadratic fits the 3x3 neighbourhood by least squares; coordinates are limited to one pixel,
    and a fit without a maximum gives no offset.
    """
    smooth = np.log(np.maximum(cv2.GaussianBlur(probability, (0, 0), sigma), _TINY))
    steps = (-1, 0, 1)
    log = np.stack([[smooth[rows + dy, columns + dx] for dx in steps] for dy in steps])
    by_column, by_row = log.sum(axis=0), log.sum(axis=1)
    gx, gy = (by_column[2] - by_column[0]) / 6, (by_row[2] - by_row[0]) / 6
    hxx = (by_column[0] - 2 * by_column[1] + by_column[2]) / 3
    hyy = (by_row[0] - 2 * by_row[1] + by_row[2]) / 3
    hxy = (log[0, 0] + log[2, 2] - log[0, 2] - log[2, 0]) / 4
    determinant = hxx * hyy - hxy * hxy
    peaked = (determinant > 0) & (hxx < 0)
    safe = np.where(peaked, determinant, 1.0)
    offsets = np.stack([-(hyy * gx - hxy * gy) / safe, -(hxx * gy - hxy * gx) / safe], axis=1)
    return np.where(peaked[:, None], np.clip(offsets, -1, 1), 0.0).astype(np.float32)


def sample_descriptors(descriptors: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Bicubic descriptors of length 1 at key points.

    Args:
        descriptors: (C, h, w) of length 1; the centre of cell (i, j) is pixel (8j + 3.5, 8i + 3.5).
        points: (N, 2) in pixels.

    Returns:
        (N, C) float32.
    """
    channels, rows, columns = descriptors.shape
    table = np.ascontiguousarray(descriptors.transpose(1, 2, 0)).reshape(-1, channels)
    cells = (points.astype(np.float64) - 0.5 * (CELL - 1)) / CELL
    base = np.floor(cells).astype(np.int64)
    weights = cubic_weights(cells - base)
    result = np.zeros((len(points), channels), np.float32)
    for i in range(4):
        row = np.clip(base[:, 1] + i - 1, 0, rows - 1)
        for j in range(4):
            column = np.clip(base[:, 0] + j - 1, 0, columns - 1)
            weight = (weights[:, 1, i] * weights[:, 0, j]).astype(np.float32)
            result += weight[:, None] * table[row * columns + column]
    return unit_descriptors(result)


def unit_descriptors(descriptors: np.ndarray, axis: int = -1) -> np.ndarray:
    """Descriptors along an axis, of bytes or of other length, as float32 of length 1."""
    values = descriptors.astype(np.float32, copy=False)
    return values / np.maximum(np.linalg.norm(values, axis=axis, keepdims=True), _TINY)


def cubic_weights(fraction: np.ndarray, a: float = -0.75) -> np.ndarray:
    """Weights (..., 4) of the four neighbours for cubic convolution at `fraction` (...) in [0, 1)."""
    t = fraction[..., None] + np.array([1.0, 0.0, -1.0, -2.0])
    t = np.abs(t)
    near = ((a + 2) * t - (a + 3)) * t * t + 1
    far = ((t - 5) * t + 8) * t * a - 4 * a
    return np.where(t <= 1, near, np.where(t < 2, far, 0.0))
