"""What a sensor_msgs/CameraInfo says of a lens."""
from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

#: By ROS's names the one of sensor.yaml, and how many coefficients there are.
DISTORTIONS = {"": ("radial-tangential", (0, 4, 5)), "none": ("radial-tangential", (0, 4, 5)),
               "plumb_bob": ("radial-tangential", (4, 5)), "radtan": ("radial-tangential", (4, 5)),
               "equidistant": ("equidistant", (4,)), "fisheye": ("equidistant", (4,))}
#: k1 k2 p1 p2 k3 k4 k5 k6 ...: without those behind k3 it is plumb_bob.
RATIONAL, PLUMB_BOB_MOST = "rational_polynomial", 5


class LensError(Exception):
    """What was found, and what was expected."""


def _listed(numbers: Any) -> str:
    return "[" + ", ".join(repr(float(number)) for number in numbers) + "]"


def place_yaml(body_from_sensor: np.ndarray) -> str:
    """Where a sensor is, as a sensor.yaml of EuRoC says it."""
    return f"T_BS:\n  cols: 4\n  rows: 4\n  data: {_listed(body_from_sensor.ravel())}\n"


class Lens(NamedTuple):
    """Pixels."""

    size: tuple[int, int]
    intrinsics: tuple[float, ...]  #: fx, fy, cx, cy
    model: str  #: As of sensor.yaml; ROS's where it is not known.
    coefficients: np.ndarray
    is_known: bool  #: Else it has a distortion that no run knows of, and the coefficients say nothing.

    def sensor_yaml(self, rate_hz: float, body_from_cam: np.ndarray) -> str:
        """A camera's of EuRoC."""
        return (f"sensor_type: camera\n{place_yaml(body_from_cam)}"
                f"rate_hz: {max(rate_hz, 1e-3)!r}\nresolution: [{self.size[0]}, {self.size[1]}]\ncamera_model: pinhole\n"
                f"intrinsics: {_listed(self.intrinsics)}\n"
                f"distortion_model: {self.model}\ndistortion_coefficients: {_listed(self.coefficients)}\n")

    def camera_yaml(self, rate_hz: float) -> str:
        """A camera.yaml of values from which the lens is to be found."""
        values = "".join(f"{name}: {value!r}\n" for name, value in zip(("fx", "fy", "cx", "cy"), self.intrinsics))
        return (f"model: auto\nwidth: {self.size[0]}\nheight: {self.size[1]}\n{values}"
                f"rate_hz: {max(rate_hz, 1e-3)!r}\n")


def is_rectified(image_topic: str) -> bool:
    """By the names that ROS's image pipeline and drivers give."""
    return any(part.startswith("image_rect") for part in image_topic.split("/"))


def _field(info: Any, name: str) -> np.ndarray:
    """ROS 1 has large letters."""
    return np.asarray(getattr(info, name.upper()) if hasattr(info, name.upper()) else getattr(info, name), float)


def _distortion(info: Any) -> tuple[str, np.ndarray, bool]:
    model, coefficients = info.distortion_model.strip(), _field(info, "d")
    if model == RATIONAL:
        if np.any(coefficients[PLUMB_BOB_MOST:] != 0):
            return model, coefficients, False
        model, coefficients = "plumb_bob", coefficients[:PLUMB_BOB_MOST]
    if model not in DISTORTIONS:
        raise LensError(f"distortion_model is '{model}': expected plumb_bob, rational_polynomial or equidistant")
    name, counts = DISTORTIONS[model]
    if len(coefficients) not in counts:
        raise LensError(f"{len(coefficients)} coefficients of {model or 'no distortion'}: expected "
                        f"{' or '.join(map(str, counts))}")
    if not np.isfinite(coefficients).all():
        raise LensError(f"coefficients are {_listed(coefficients)}: expected finite numbers")
    return name, coefficients if len(coefficients) else np.zeros(4), True


def lens_of(info: Any, rectified: bool) -> Lens:
    """The lens that took the images, or the pinhole that they were rectified to.

    Raises :class:`LensError` for what is no calibration.
    """
    # Of rectified images K and D are of the camera before that; P, 3x4, begins with the matrix of the pinhole after it. A
    # camera that rectifies by itself may leave P out, and has no D.
    projection = _field(info, "p").reshape(3, 4)[:, :3].ravel()
    if rectified and (projection.any() or _field(info, "d").any()):
        letter, matrix, name, coefficients, is_known = "P", projection, "radial-tangential", np.zeros(4), True
    else:
        letter, matrix = "K", _field(info, "k")
        name, coefficients, is_known = _distortion(info)
    if not (np.isfinite(matrix).all() and matrix[0] > 0 and matrix[4] > 0):
        raise LensError(f"of {letter}, fx is {matrix[0]}, fy {matrix[4]}: expected focal lengths above 0, as of a camera that "
                        "was calibrated (--camera-info none leaves it out)")
    intrinsics = tuple(float(matrix[index]) for index in (0, 4, 2, 5))
    return Lens((int(info.width), int(info.height)), intrinsics, name, coefficients, is_known)
