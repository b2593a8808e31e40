"""Streets: two rows of houses seen from between them, as from a car or a low drone that looks ahead.

World axes as of a room: x along the street, y across, z down; the ground is at z = 0. Lengths are in
metres.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from deepuav_training.config import check_field
from deepuav_training.data.faces import Face, halves
from deepuav_training.data.rooms import Box, Room, Side, Viewpoint, textured

_ATTEMPTS = 30  # at a camera's place
_STEP_BACK = 0.8  # by which a camera comes nearer to where it was, where it cannot be
_SKY_PX = 64  # of the sky's texture, a side
_SKY = (140.0, 250.0)  # brightness
_MARGIN_M = 0.6  # of a camera from the edges of the street
_AHEAD_M = (8.0, 50.0)  # to what a camera looks at


@dataclass(frozen=True)
class StreetConfig:
    """The distribution of streets and of cameras in them."""

    length_m: tuple = (60.0, 140.0)
    width_m: tuple = (7.0, 24.0)  # between the rows of houses
    house_m: tuple = (6.0, 20.0)  # along the street
    house_depth_m: float = 10.0
    house_height_m: tuple = (3.0, 16.0)
    gap_share: float = 0.3  # of houses that another one does not follow at once
    step_back_m: float = 4.0  # of a house from the street, at most
    things: tuple = (10, 35)  # cars, posts, hedges and the like, as boxes
    thing_side_m: tuple = (0.25, 4.0)
    thing_height_m: tuple = (0.4, 5.0)
    moving_max: int = 5  # things that stand somewhere else in each view
    panel_m: float = 6.0  # largest side of a piece of a photograph
    texture_px_m: tuple = (15.0, 90.0)
    contrast_min: float = 0.3
    height_m: tuple = (1.2, 14.0)  # of cameras, spread by their logarithm
    focal: tuple = (0.55, 1.1)  # as shares of the view's width
    yaw_deg: float = 25.0  # of a look ahead
    pitch_deg: float = 8.0  # of a look ahead; from higher up it is lower
    roll_deg: float = 8.0
    near_share: float = 0.5  # views that are a small step from another one
    near_baseline: tuple = (0.01, 0.15)  # as shares of the distance of what is looked at
    far_baseline: tuple = (0.15, 0.75)
    near_turn_deg: float = 6.0
    aside: float = 0.35  # of a step, across the street and up or down, as a share of it

    def check(self, where: str) -> None:
        for name in ("length_m", "width_m", "house_m", "house_height_m", "things", "thing_side_m",
                     "thing_height_m", "texture_px_m", "height_m", "focal", "near_baseline",
                     "far_baseline"):
            low, high = getattr(self, name)
            check_field(0 < low <= high, where, name, [low, high], "0 < least <= most")
        check_field(self.width_m[0] > 4 * _MARGIN_M, where, "width_m", self.width_m[0],
                    f"more than {4 * _MARGIN_M} m, so that there is room for a camera")
        check_field(self.far_baseline[1] < 1, where, "far_baseline", self.far_baseline[1],
                    "less than 1, so that what is looked at stays ahead")
        check_field(self.panel_m > 0, where, "panel_m", self.panel_m, "positive")
        check_field(0 < self.contrast_min <= 1, where, "contrast_min", self.contrast_min,
                    "a share in (0, 1]")


@dataclass(frozen=True)
class Street:
    """A street in its surroundings, whose sky counts as moving: nothing of it is ever found again."""

    place: Room
    width_m: float


def make_street(photo: np.ndarray, paint: np.ndarray, rng: np.random.Generator,
                config: StreetConfig) -> Street:
    """Ground, houses and things that show pieces of two photographs (H, W) uint8 under a sky."""
    length, width = rng.uniform(*config.length_m), rng.uniform(*config.width_m)
    half = np.array([0.5 * length, 0.5 * width + config.step_back_m + config.house_depth_m,
                     config.house_height_m[1] + config.height_m[1]])
    hull = Box(np.array([0, 0, -half[2]]), half, 0.0)
    things = [_draw_thing(length, width, rng, config)
              for _ in range(rng.integers(config.things[0], config.things[1] + 1))]
    boxes = [house for side in (-1, 1) for house in _row(side, length, width, rng, config)] + things
    *walls, ceiling, ground = hull.sides()
    faces = [_sky(side, rng) for side in (*walls, ceiling)]
    faces += _panels([ground], (photo, paint), rng, config)
    for box in boxes:
        faces += _panels(_seen_sides(box), (photo, paint), rng, config)
    return Street(Room(hull, boxes, faces, (photo, paint)), width)


def passing_faces(street: Street, rng: np.random.Generator, config: StreetConfig) -> list[Face]:
    """Faces of things that are there at one moment only."""
    length = 2 * street.place.hull.half[0]
    return [textured(side, street.place.photographs, rng, config, moving=True)
            for _ in range(rng.integers(0, config.moving_max + 1))
            for side in _seen_sides(_draw_thing(length, street.width_m, rng, config))]


def _row(side: int, length: float, width: float, rng: np.random.Generator, config: StreetConfig
         ) -> list[Box]:
    """Houses along one side (-1 or 1) of the street, from its begin to its end."""
    houses, begin = [], -0.5 * length
    while begin < 0.5 * length:
        along = rng.uniform(*config.house_m)
        back = rng.uniform(0, config.step_back_m) if rng.random() < 0.5 else 0.0
        half = 0.5 * np.array([along, config.house_depth_m, rng.uniform(*config.house_height_m)])
        houses.append(Box(np.array([begin + half[0], side * (0.5 * width + back + half[1]),
                                    -half[2]]), half, 0.0))
        gap = rng.uniform(0.5, 1.0) * along if rng.random() < config.gap_share else 0.0
        begin += along + gap
    return houses


def _draw_thing(length: float, width: float, rng: np.random.Generator, config: StreetConfig) -> Box:
    sides = np.exp(rng.uniform(*np.log(config.thing_side_m), 2))
    half = 0.5 * np.array([*sides, math.exp(rng.uniform(*np.log(config.thing_height_m)))])
    half[:2] = np.minimum(half[:2], 0.2 * width)
    # More of them at the sides than in the middle.
    across = 0.5 * width * np.copysign(math.sqrt(rng.random()), rng.uniform(-1, 1))
    return Box(np.array([rng.uniform(-0.5, 0.5) * length, across, -half[2]]), half,
               0.15 * rng.normal())


def _seen_sides(box: Box) -> list[Side]:
    """All but the one it stands on."""
    return box.sides()[:5]


def _panels(sides: list[Side], photographs: tuple[np.ndarray, np.ndarray],
            rng: np.random.Generator, config: StreetConfig) -> list[Face]:
    """The sides in pieces no larger than a photograph is sharp."""
    faces = []
    for corner, along_u, along_v in sides:
        across, down = (max(1, math.ceil(np.linalg.norm(edge) / config.panel_m))
                        for edge in (along_u, along_v))
        u, v = along_u / across, along_v / down
        faces += [textured((corner + i * u + j * v, u, v), photographs, rng, config)
                  for i in range(across) for j in range(down)]
    return faces


def _sky(side: Side, rng: np.random.Generator) -> Face:
    """Soft clouds."""
    noise = rng.normal(size=(_SKY_PX, _SKY_PX)).astype(np.float32)
    clouds = cv2.GaussianBlur(noise, (0, 0), rng.uniform(2, 12))
    low, high = np.sort(rng.uniform(*_SKY, 2))
    texture = cv2.normalize(clouds, None, low, high, cv2.NORM_MINMAX)
    return Face(*side, halves(texture.astype(np.uint8)), True)


def draw_look(street: Street, rng: np.random.Generator, config: StreetConfig) -> Viewpoint:
    """Any view along the street."""
    heading = 1.0 if rng.random() < 0.5 else -1.0
    half_length = street.place.hull.half[0]
    aside = 0.5 * street.width_m - _MARGIN_M
    for _ in range(_ATTEMPTS):
        height = math.exp(rng.uniform(*np.log(config.height_m)))
        place = np.array([heading * rng.uniform(-0.9, 0.2) * half_length,
                          aside * rng.uniform(-1, 1), -height])
        if street.place.is_free(place):
            break
    distance = math.exp(rng.uniform(*np.log(_AHEAD_M)))
    yaw = math.radians(config.yaw_deg) * rng.uniform(-1, 1)
    pitch = math.radians(config.pitch_deg) * rng.uniform(-1, 1)
    drop = min(0.6 * rng.random() * height, 0.6 * distance)
    ahead = np.array([heading * math.cos(yaw), math.sin(yaw), math.tan(pitch)])
    return Viewpoint(place, place + distance * ahead + (0, 0, drop), _roll(rng, config))


def next_look(view: Viewpoint, street: Street, rng: np.random.Generator, config: StreetConfig
              ) -> Viewpoint:
    """A view of nearly the same from farther along the street, or from behind: near or far."""
    toward = view.target - view.place
    distance = np.linalg.norm(toward)
    near = rng.random() < config.near_share
    target = view.target + (math.tan(math.radians(config.near_turn_deg)) * distance
                            * rng.uniform(-1, 1, 3))
    baseline = rng.uniform(*(config.near_baseline if near else config.far_baseline)) * distance
    along = np.copysign(1.0, toward[0]) * (1.0 if rng.random() < 0.6 else -1.0)
    step = baseline * np.array([along, *(config.aside * rng.normal(size=2))])
    for _ in range(_ATTEMPTS):
        if street.place.is_free(view.place + step):
            break
        step *= _STEP_BACK
    turn = math.radians(config.near_turn_deg)
    roll = view.roll_rad + turn * rng.uniform(-1, 1) if near else _roll(rng, config)
    return Viewpoint(view.place + step, target, roll)


def _roll(rng: np.random.Generator, config: StreetConfig) -> float:
    return math.radians(config.roll_deg) * rng.uniform(-1, 1)
