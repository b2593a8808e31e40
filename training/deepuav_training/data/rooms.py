"""Halls and rooms: textured boxes seen from among them, with near and far side by side.

World axes: x and y along the floor, z down; the floor is at z = 0. Lengths are in metres.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np

from deepuav_training.config import check_field
from deepuav_training.data.faces import LEAST_SIDE_PX, Face, halves
from deepuav_training.data.render import Camera, pinhole

_CLEARANCE_M = 0.4  # of a camera from everything
_ATTEMPTS = 30  # at a camera's place
_STEP_BACK = 0.8  # by which a camera comes nearer to where it was, where it cannot be
_DIRECTIONS = 4  # of which the one with the longest view is taken
_DARKEST, _BRIGHTEST = 0.5, 1.1  # light of a face

Side = tuple[np.ndarray, np.ndarray, np.ndarray]  # a corner and two edges, each (3,)


class Textures(Protocol):
    """Of a configuration, what decides over a face's texture."""

    texture_px_m: tuple  # pixels of a texture a metre
    contrast_min: float  # of a texture, as a share of its photograph's


@dataclass(frozen=True)
class RoomConfig:
    """The distribution of rooms and of cameras in them."""

    side_m: tuple = (4.0, 20.0)
    height_m: tuple = (2.5, 9.0)
    boxes: tuple = (10, 40)
    box_side_m: tuple = (0.3, 3.0)
    raised_share: float = 0.3  # boxes that hang in the air, as shelves and pipes do
    moving_max: int = 3  # boxes of a view that stand somewhere else in each
    texture_px_m: tuple = (60.0, 250.0)  # pixels of a texture a metre
    contrast_min: float = 0.3  # of a texture, as a share of its photograph's
    focal: tuple = (0.55, 1.1)  # as shares of the view's width
    pitch_deg: float = 30.0
    roll_deg: float = 15.0
    any_roll_share: float = 0.15
    near_share: float = 0.6  # views that are a small step from another one
    near_baseline: tuple = (0.01, 0.15)  # as shares of the distance of what is looked at
    far_baseline: tuple = (0.15, 0.8)
    near_turn_deg: float = 8.0

    def check(self, where: str) -> None:
        for name in ("side_m", "height_m", "boxes", "box_side_m", "texture_px_m", "focal",
                     "near_baseline", "far_baseline"):
            low, high = getattr(self, name)
            check_field(0 < low <= high, where, name, [low, high], "0 < least <= most")
        for name in ("side_m", "height_m"):
            least = getattr(self, name)[0]
            check_field(least > 4 * _CLEARANCE_M, where, name, least,
                        f"more than {4 * _CLEARANCE_M} m, so that there is room for a camera")
        check_field(0 < self.contrast_min <= 1, where, "contrast_min", self.contrast_min,
                    "a share in (0, 1]")


@dataclass(frozen=True)
class Box:
    """A box that stands upright."""

    centre: np.ndarray  # (3,)
    half: np.ndarray  # (3,) half of its sides
    turn_rad: float  # about z

    @property
    def axes(self) -> np.ndarray:
        """The directions of its sides, rows of (3, 3)."""
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])

    def clearance(self, place: np.ndarray) -> np.ndarray:
        """How far a place (3,) is beyond the box along each of its axes; negative within."""
        return np.abs(self.axes @ (place - self.centre)) - self.half

    def sides(self) -> list[Side]:
        """All six."""
        x, y, z = 2 * self.half[:, None] * self.axes
        low = self.centre - 0.5 * (x + y + z)
        return [(low, x, z), (low + y, x, z), (low, y, z), (low + x, y, z), (low, x, y),
                (low + z, x, y)]


@dataclass(frozen=True)
class Room:
    """Walls, things and their textures; cameras stay within `hull` and out of `boxes`."""

    hull: Box
    boxes: list[Box]
    faces: list[Face]
    photographs: tuple[np.ndarray, np.ndarray]

    def is_free(self, place: np.ndarray) -> bool:
        """Whether a camera may be at a place (3,)."""
        return ((self.hull.clearance(place) < -_CLEARANCE_M).all()
                and all((box.clearance(place) > _CLEARANCE_M).any() for box in self.boxes))


@dataclass(frozen=True)
class Viewpoint:
    """Where a camera is and what it looks at."""

    place: np.ndarray  # (3,)
    target: np.ndarray  # (3,)
    roll_rad: float


def make_room(photo: np.ndarray, paint: np.ndarray, rng: np.random.Generator,
              config: RoomConfig) -> Room:
    """A closed room whose walls and boxes show pieces of two photographs (H, W) uint8."""
    size = np.array([*rng.uniform(*config.side_m, 2), rng.uniform(*config.height_m)])
    hull = Box(np.array([0, 0, -0.5 * size[2]]), 0.5 * size, 0.0)
    count = rng.integers(config.boxes[0], config.boxes[1] + 1)
    boxes = [_draw_box(hull, rng, config) for _ in range(count)]
    faces = [textured(side, (photo, paint), rng, config)
             for box in (hull, *boxes) for side in box.sides()]
    return Room(hull, boxes, faces, (photo, paint))


def moving_faces(room: Room, rng: np.random.Generator, config: RoomConfig) -> list[Face]:
    """Faces of boxes that are there at one moment only."""
    return [textured(side, room.photographs, rng, config, moving=True)
            for _ in range(rng.integers(0, config.moving_max + 1))
            for side in _draw_box(room.hull, rng, config).sides()]


def _draw_box(hull: Box, rng: np.random.Generator, config: RoomConfig) -> Box:
    half = np.minimum(0.5 * np.exp(rng.uniform(*np.log(config.box_side_m), 3)), 0.4 * hull.half)
    place = hull.half[:2] * rng.uniform(-1, 1, 2)
    above = 2 * (hull.half[2] - half[2])
    raised = rng.uniform(0, above) if rng.random() < config.raised_share else 0.0
    return Box(np.array([*place, -half[2] - raised]), half, rng.uniform(0, math.pi))


def textured(side: Side, photographs: tuple[np.ndarray, np.ndarray], rng: np.random.Generator,
             config: Textures, moving: bool = False) -> Face:
    """A piece of one of the photographs on a side, at a random scale, contrast and light."""
    photo = photographs[rng.integers(2)]
    full = photo.shape[::-1]
    density = math.exp(rng.uniform(*np.log(config.texture_px_m)))
    size = [int(np.clip(density * np.linalg.norm(edge), LEAST_SIDE_PX, most))
            for edge, most in zip(side[1:], full, strict=True)]
    left, top = (rng.integers(0, most - part + 1) for most, part in zip(full, size, strict=True))
    piece = photo[top:top + size[1], left:left + size[0]].astype(np.float32)
    mean, contrast = piece.mean(), rng.uniform(config.contrast_min, 1.0)
    lit = (mean + contrast * (piece - mean)) * rng.uniform(_DARKEST, _BRIGHTEST)
    texture = np.clip(np.rint(lit), 0, 255).astype(np.uint8)
    return Face(*side, halves(texture), moving)


def draw_viewpoint(room: Room, rng: np.random.Generator, config: RoomConfig) -> Viewpoint:
    """Any view of the room that does not only show the nearest wall."""
    for _ in range(_ATTEMPTS):
        place = room.hull.centre + room.hull.half * rng.uniform(-0.9, 0.9, 3)
        if room.is_free(place):
            break
    drawn = [_draw_direction(rng, config) for _ in range(_DIRECTIONS)]
    distance, ahead = max(((_distance_to_wall(room.hull, place, direction), direction)
                           for direction in drawn), key=lambda found: found[0])
    return Viewpoint(place, place + 0.5 * distance * ahead, _draw_roll(rng, config))


def _draw_direction(rng: np.random.Generator, config: RoomConfig) -> np.ndarray:
    yaw = rng.uniform(0, 2 * math.pi)
    pitch = math.radians(config.pitch_deg) * rng.uniform(-1, 1)
    return np.array([math.cos(yaw) * math.cos(pitch), math.sin(yaw) * math.cos(pitch),
                     math.sin(pitch)])


def other_viewpoint(view: Viewpoint, room: Room, rng: np.random.Generator, config: RoomConfig
                    ) -> Viewpoint:
    """A view of nearly the same from elsewhere: a small step away, or far."""
    distance = np.linalg.norm(view.target - view.place)
    near = rng.random() < config.near_share
    turn = math.radians(config.near_turn_deg)
    target = view.target + math.tan(turn) * distance * rng.uniform(-1, 1, 3)
    direction = rng.normal(size=3) * (1, 1, 0.5)
    baseline = rng.uniform(*(config.near_baseline if near else config.far_baseline)) * distance
    step = baseline * direction / np.linalg.norm(direction)
    for _ in range(_ATTEMPTS):
        if room.is_free(view.place + step):
            break
        step *= _STEP_BACK
    roll = view.roll_rad + turn * rng.uniform(-1, 1) if near else _draw_roll(rng, config)
    return Viewpoint(view.place + step, target, roll)


def _draw_roll(rng: np.random.Generator, config: RoomConfig) -> float:
    limit = 180.0 if rng.random() < config.any_roll_share else config.roll_deg
    return math.radians(rng.uniform(-limit, limit))


def _distance_to_wall(hull: Box, place: np.ndarray, direction: np.ndarray) -> float:
    """From a place within an unturned box along a direction of length 1."""
    wall = hull.centre + np.copysign(hull.half, direction)
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.nanmin((wall - place) / direction))


def camera_at(view: Viewpoint, focal_px: float, width: int, height: int) -> Camera:
    """The camera with its target in the middle, upright but for the roll."""
    ahead = view.target - view.place
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross([0.0, 0.0, 1.0], ahead)
    right /= np.linalg.norm(right)
    upright = np.stack([right, np.cross(ahead, right), ahead])
    roll, _ = cv2.Rodrigues(np.array([0.0, 0.0, view.roll_rad]))
    rotation = roll @ upright
    return Camera(pinhole(focal_px, width, height), np.c_[rotation, -rotation @ view.place],
                  width, height)
