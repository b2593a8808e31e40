"""Measures of key points and matches between two views of a plane."""

import cv2
import numpy as np
import poselib

from deepuav_training.data.homography import inside, warp_points

_INLIER_PX, _ITERATIONS = 3.0, 5000
_RESAMPLES = 2000
_OUTSIDE = 2.5  # per cent of the resamples below an interval, and above


def mutual_nearest(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Pairs (M, 2) of rows of a (N, C) and b (K, C), of length 1, nearest to one another."""
    if len(a) == 0 or len(b) == 0:
        return np.zeros((0, 2), np.int64)
    similarity = a @ b.T
    best_b, best_a = similarity.argmax(axis=1), similarity.argmax(axis=0)
    rows = np.flatnonzero(best_a[best_b] == np.arange(len(a)))
    return np.stack([rows, best_b[rows]], axis=1)


def precision(points_a: np.ndarray, points_b: np.ndarray, b_from_a: np.ndarray, limit_px: float
              ) -> float:
    """Share of the matches whose points lie within `limit_px` of one another in b."""
    if len(points_a) == 0:
        return 0.0
    error = np.linalg.norm(warp_points(b_from_a, points_a) - points_b, axis=1)
    return float(np.mean(error <= limit_px))  # NaN, a point behind the camera, counts as wrong


def repeatability(points_a: np.ndarray, points_b: np.ndarray, b_from_a: np.ndarray,
                  size_a: tuple[int, int], size_b: tuple[int, int], limit_px: float) -> float:
    """Share of the points in the common area that have one of the other view within `limit_px`.

    Sizes are (width, height).
    """
    a_in_b, b_in_a = warp_points(b_from_a, points_a), warp_points(np.linalg.inv(b_from_a), points_b)
    a_in_b, b = a_in_b[inside(a_in_b, *size_b)], points_b[inside(b_in_a, *size_a)]
    if len(a_in_b) == 0 or len(b) == 0:
        return 0.0
    distance = np.linalg.norm(a_in_b[:, None] - b[None], axis=2)
    repeated = (distance.min(axis=1) <= limit_px).sum() + (distance.min(axis=0) <= limit_px).sum()
    return float(repeated / (len(a_in_b) + len(b)))


def homography_error(points_a: np.ndarray, points_b: np.ndarray, b_from_a: np.ndarray,
                     width: int, height: int, estimator: str = "lo-ransac") -> float:
    """Mean error of the corners (pixels) of the homography that is found; inf if none is.

    `estimator` is "lo-ransac" (PoseLib) or "ransac" (OpenCV).
    """
    if len(points_a) < 4:
        return np.inf
    a, b = points_a.astype(np.float64), points_b.astype(np.float64)
    if estimator == "ransac":
        cv2.setRNGSeed(0)
        estimate, _ = cv2.findHomography(a, b, cv2.RANSAC, _INLIER_PX, maxIters=_ITERATIONS)
    else:
        estimate, _ = poselib.estimate_homography(
            a, b, {"max_reproj_error": _INLIER_PX, "max_iterations": _ITERATIONS, "seed": 0})
    if estimate is None or abs(estimate[2, 2]) < 1e-9:
        return np.inf
    estimate /= estimate[2, 2]  # the sign decides what lies behind the camera
    corners = np.array([[0, 0], [width - 1, 0], [0, height - 1], [width - 1, height - 1]], float)
    error = np.linalg.norm(warp_points(estimate, corners) - warp_points(b_from_a, corners), axis=1)
    return float(error.mean()) if np.all(np.isfinite(error)) else np.inf


def area_under_curve(errors: list[float], limit: float) -> float:
    """Area under the recall over error curve up to `limit`, of 1 at most."""
    ordered = np.sort(errors)
    recall = np.arange(1, len(ordered) + 1) / len(ordered)
    below = int(np.searchsorted(ordered, limit))
    x = np.concatenate([[0.0], ordered[:below], [limit]])
    y = np.concatenate([[0.0], recall[:below], [recall[below - 1] if below else 0.0]])
    return float(np.trapezoid(y, x) / limit)


def paired_difference(errors: list[float], baseline: list[float], limit: float, seed: int
                      ) -> tuple[float, float, float]:
    """How much larger the area under the curve of `errors` is, with the bounds of what chance allows.

    Both are errors of the same pairs. The bounds hold 95 % of the differences of bootstrap samples of the pairs.
    """
    both = np.array([errors, baseline])

    def difference(chosen: np.ndarray) -> float:
        return area_under_curve(chosen[0], limit) - area_under_curve(chosen[1], limit)

    count = both.shape[1]
    rng = np.random.default_rng(seed)
    drawn = [difference(both[:, rng.integers(count, size=count)]) for _ in range(_RESAMPLES)]
    low, high = np.percentile(drawn, [_OUTSIDE, 100 - _OUTSIDE])
    return difference(both), float(low), float(high)
