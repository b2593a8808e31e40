"""How the frames of a ROS system lie to one another, as /tf_static says."""
from __future__ import annotations

from typing import Any

import numpy as np

RIGID_TOLERANCE = 1e-3


def matrix_of(numbers: Any) -> np.ndarray | None:
    """4x4 of nested or flat numbers; None for what is no rigid transform."""
    matrix = np.asarray(numbers, float)
    if matrix.size != 16:
        return None
    matrix = matrix.reshape(4, 4)
    rotation = matrix[:3, :3]
    rigid = (np.isfinite(matrix).all() and np.allclose(matrix[3], (0, 0, 0, 1)) and np.linalg.det(rotation) > 0 and
             np.allclose(rotation @ rotation.T, np.eye(3), atol=RIGID_TOLERANCE))
    return matrix if rigid else None


def _matrix(transform: Any) -> np.ndarray:
    q, t = transform.rotation, transform.translation
    x, y, z, w = np.array((q.x, q.y, q.z, q.w)) / np.linalg.norm((q.x, q.y, q.z, q.w))
    matrix = np.eye(4)
    matrix[:3, :3] = ((1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
                      (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
                      (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)))
    matrix[:3, 3] = t.x, t.y, t.z
    return matrix


class TransformTree:
    """Static transforms."""

    def __init__(self) -> None:
        self.neighbours: dict[str, dict[str, np.ndarray]] = {}

    def add(self, message: Any) -> None:
        """A tf2_msgs/TFMessage."""
        for one in message.transforms:
            parent, child = one.header.frame_id.lstrip("/"), one.child_frame_id.lstrip("/")
            parent_from_child = _matrix(one.transform)
            if np.isfinite(parent_from_child).all():
                self.neighbours.setdefault(parent, {})[child] = parent_from_child
                self.neighbours.setdefault(child, {})[parent] = np.linalg.inv(parent_from_child)

    def between(self, a: str, b: str) -> np.ndarray | None:
        """a_from_b, over as few frames as possible; None where nothing connects them."""
        a, b = a.lstrip("/"), b.lstrip("/")
        found, open_frames = {a: np.eye(4)}, [a]
        while open_frames and b not in found:
            frame = open_frames.pop(0)
            for near, frame_from_near in self.neighbours.get(frame, {}).items():
                if near not in found:
                    found[near] = found[frame] @ frame_from_near
                    open_frames.append(near)
        return found.get(b)
