"""Homographies between views of a flat scene: 3x3 matrices acting on pixel coordinates.

Pixel (0, 0) is the centre of the top-left pixel. A homography named `a_from_b` takes points of
image b to points of image a.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from deepuav_training.config import check_field


@dataclass(frozen=True)
class HomographyConfig:
    """The distribution that random views are drawn from."""

    rotation_deg: float = 45.0  # in-plane rotation is uniform in +- this
    any_rotation_share: float = 0.25  # share of views with a rotation uniform in +-180 degrees
    scale_min: float = 0.5  # scale is log-uniform between these
    scale_max: float = 2.0
    perspective: float = 0.25  # largest change of depth from the image's centre to its edge
    translation: float = 0.15  # largest shift of the centre, as a share of the image's size

    def check(self, where: str) -> None:
        check_field(0 <= self.rotation_deg <= 180, where, "rotation_deg", self.rotation_deg,
                    "degrees in [0, 180]")
        check_field(0 <= self.any_rotation_share <= 1, where, "any_rotation_share",
                    self.any_rotation_share, "a share in [0, 1]")
        check_field(0 < self.scale_min <= self.scale_max, where, "scale_min", self.scale_min,
                    "0 < scale_min <= scale_max")
        check_field(0 <= self.perspective < 0.7, where, "perspective", self.perspective,
                    "a value in [0, 0.7)")
        check_field(0 <= self.translation < 1, where, "translation", self.translation,
                    "a share in [0, 1)")


def sample_homography(rng: np.random.Generator, config: HomographyConfig, width: int, height: int
                      ) -> np.ndarray:
    """Draws new_from_old, (3, 3) float64, for images of width x height pixels.

    The centre of the image keeps the scale drawn; a tilt of the ground plane gives the perspective.
    """
    limit = 180.0 if rng.random() < config.any_rotation_share else config.rotation_deg
    angle = math.radians(rng.uniform(-limit, limit))
    scale = math.exp(rng.uniform(math.log(config.scale_min), math.log(config.scale_max)))
    shift = rng.uniform(-config.translation, config.translation, 2) * (width, height)
    tilt_direction = rng.uniform(0, 2 * math.pi)
    tilt = config.perspective * math.sqrt(rng.random())
    half = 0.5 * max(width, height)
    tilt_x, tilt_y = tilt * math.cos(tilt_direction) / half, tilt * math.sin(tilt_direction) / half
    centre = np.array([0.5 * (width - 1), 0.5 * (height - 1)])
    perspective = np.array([[1, 0, 0], [0, 1, 0], [tilt_x, tilt_y, 1]], dtype=np.float64)
    return (translation_matrix(centre + shift) @ similarity_matrix(angle, scale) @ perspective
            @ translation_matrix(-centre))


def translation_matrix(shift: np.ndarray) -> np.ndarray:
    """The homography (3, 3) that moves points by `shift` (2,)."""
    return np.array([[1, 0, shift[0]], [0, 1, shift[1]], [0, 0, 1]], dtype=np.float64)


def similarity_matrix(angle_rad: float, scale: float) -> np.ndarray:
    """The homography (3, 3) that turns about the origin and scales."""
    c, s = scale * math.cos(angle_rad), scale * math.sin(angle_rad)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]], dtype=np.float64)


def resize_matrix(scale_x: float, scale_y: float) -> np.ndarray:
    """new_from_old (3, 3) of an image resize, where pixel areas (not centres) are scaled."""
    return np.array([[scale_x, 0, 0.5 * scale_x - 0.5], [0, scale_y, 0.5 * scale_y - 0.5],
                     [0, 0, 1]], dtype=np.float64)


def warp_points(a_from_b: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Takes points (N, 2) of image b to image a; points behind the camera become NaN."""
    projected = points @ a_from_b[:, :2].T + a_from_b[:, 2]
    depth = np.where(projected[:, 2:] > 1e-9, projected[:, 2:], np.nan)
    return projected[:, :2] / depth


def inside(points: np.ndarray, width: int, height: int, border: float = 0.0) -> np.ndarray:
    """Mask (N,) of the points (N, 2) at least `border` pixels within the image; NaN is outside."""
    with np.errstate(invalid="ignore"):
        return ((points[:, 0] >= border) & (points[:, 0] <= width - 1 - border)
                & (points[:, 1] >= border) & (points[:, 1] <= height - 1 - border))


def local_scale(a_from_b: np.ndarray, point: np.ndarray) -> float:
    """How many pixels of a one pixel of b at `point` (2,) becomes, by the root of the area."""
    x, y, w = a_from_b @ (point[0], point[1], 1.0)
    del x, y
    return math.sqrt(abs(np.linalg.det(a_from_b) / w**3))


def warp_image(image: np.ndarray, new_from_image: np.ndarray, width: int, height: int
               ) -> tuple[np.ndarray, np.ndarray]:
    """Warps a grey image without aliasing.

    Args:
        image: (h, w) uint8.
        new_from_image: (3, 3).
        width, height: size of the result, pixels.

    Returns:
        The view (height, width) uint8 and a mask (height, width) uint8: 255 where it shows `image`.
    """
    centre = warp_points(np.linalg.inv(new_from_image),
                         np.array([[0.5 * (width - 1), 0.5 * (height - 1)]]))[0]
    scale = local_scale(new_from_image, centre) if np.all(np.isfinite(centre)) else 1.0
    mask_source = np.full(image.shape, 255, np.uint8)
    mask = cv2.warpPerspective(mask_source, new_from_image, (width, height),
                               flags=cv2.INTER_NEAREST)
    while scale < 0.7 and min(image.shape) >= 64:
        smaller = (image.shape[1] // 2, image.shape[0] // 2)
        factor_x, factor_y = smaller[0] / image.shape[1], smaller[1] / image.shape[0]
        image = cv2.resize(image, smaller, interpolation=cv2.INTER_AREA)
        new_from_image = new_from_image @ np.linalg.inv(resize_matrix(factor_x, factor_y))
        scale *= 2.0
    view = cv2.warpPerspective(image, new_from_image, (width, height), flags=cv2.INTER_LINEAR,
                               borderMode=cv2.BORDER_CONSTANT)
    return view, mask
