"""What tests of rendered scenes share."""

import cv2
import numpy as np

from deepuav_training.data.faces import render_faces
from deepuav_training.data.render import visible_points, world_points


def smooth_texture(seed=0, size=200, blur=5):
    """Random blobs (size, size) uint8, without edges that a small shift would change much."""
    noise = np.random.default_rng(seed).uniform(0, 255, (size, size)).astype(np.float32)
    blurred = cv2.GaussianBlur(noise, (0, 0), blur)
    return cv2.normalize(blurred, None, 20, 235, cv2.NORM_MINMAX).astype(np.uint8)


def values_at(image, points):
    """Brightness (N, 1) at points (N, 2) of an image."""
    x, y = (points[:, axis:axis + 1].astype(np.float32) for axis in (0, 1))
    return cv2.remap(image, x, y, cv2.INTER_LINEAR).astype(float)


def corresponding_values(faces, cameras, points):
    """Of points (N, 2) of the first of two cameras, the share that the second one shows, and the
    brightness of those in both."""
    seen = [render_faces(faces, camera) for camera in cameras]
    moved = visible_points(seen[1], cameras[1], world_points(seen[0], cameras[0], points))
    kept = np.isfinite(moved).all(axis=1)
    values = [values_at(s.image, p) for s, p in zip(seen, (points[kept], moved[kept]), strict=True)]
    return kept.mean(), values
