"""SIFT and ORB of OpenCV, to compare with."""

import cv2
import numpy as np

from deepuav_training.runtime import Features

_RATIO = 0.8  # of the nearest's distance to the next one's: Lowe, 2004


class SiftExtractor:
    """SIFT of OpenCV, without its shift of a quarter of a pixel."""

    def __init__(self, points: int):
        self._sift = cv2.SIFT_create(nfeatures=points, enable_precise_upscale=True)
        self._points = points

    def __call__(self, image: np.ndarray) -> Features:
        found, descriptors = self._sift.detectAndCompute(image, None)
        return _features(found, descriptors, self._points, 128, np.float32, image)


class OrbExtractor:
    """ORB of OpenCV; descriptors are bytes of bits."""

    def __init__(self, points: int):
        self._orb = cv2.ORB_create(nfeatures=points)
        self._points = points

    def __call__(self, image: np.ndarray) -> Features:
        found, descriptors = self._orb.detectAndCompute(image, None)
        return _features(found, descriptors, self._points, 32, np.uint8, image)


def _features(found: tuple, descriptors: np.ndarray | None, points: int, dimension: int,
              kind: type, image: np.ndarray) -> Features:
    size = image.shape[::-1]
    if descriptors is None:
        return Features(np.zeros((0, 2), np.float32), np.zeros(0, np.float32),
                        np.zeros((0, dimension), kind), size)
    scores = np.array([point.response for point in found], np.float32)
    best = np.argsort(-scores, kind="stable")[:points]
    return Features(np.array([point.pt for point in found], np.float32)[best], scores[best],
                    descriptors[best], size)


def ratio_nearest(a: Features, b: Features) -> np.ndarray:
    """Rows (M, 2) of mutual nearest neighbours that are clearly nearer than the next one."""
    if len(a.points) == 0 or len(b.points) < 2:
        return np.zeros((0, 2), np.int64)
    matcher = cv2.BFMatcher(cv2.NORM_L2)
    back = [m.trainIdx for m in matcher.match(b.descriptors, a.descriptors)]
    rows = [(m.queryIdx, m.trainIdx) for m, n in matcher.knnMatch(a.descriptors, b.descriptors, k=2)
            if m.distance < _RATIO * n.distance and back[m.trainIdx] == m.queryIdx]
    return np.array(rows, np.int64).reshape(-1, 2)


def hamming_nearest(a: Features, b: Features) -> np.ndarray:
    """Rows (M, 2) of mutual nearest neighbours by the number of different bits."""
    if len(a.points) == 0 or len(b.points) == 0:
        return np.zeros((0, 2), np.int64)
    matches = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True).match(a.descriptors, b.descriptors)
    return np.array([(m.queryIdx, m.trainIdx) for m in matches], np.int64).reshape(-1, 2)
