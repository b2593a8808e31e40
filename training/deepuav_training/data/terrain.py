"""Random terrains: height maps under photographs, with buildings and moving things."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from deepuav_training.config import check_field
from deepuav_training.data.render import Camera, Terrain, pinhole
from deepuav_training.errors import TrainingError

_STEEP = 1.0  # slope beyond which a building's side is its wall


@dataclass(frozen=True)
class TerrainConfig:
    """The distribution of terrains and of cameras above them. Lengths as shares of the altitude."""

    cell: float = 2.0  # pixels of the texture between two heights
    flat_share: float = 0.2  # terrains without relief, with buildings alone
    relief_max: float = 0.35
    crop_min: int = 40  # cells of the height map under the whole texture
    crop_max: int = 200
    buildings_max: int = 20
    building_side_px: tuple = (24.0, 110.0)  # pixels of the texture
    building_height_max: float = 0.25
    moving_max: int = 8  # moving things in a view
    moving_side_px: tuple = (16.0, 60.0)
    moving_height_max: float = 0.04
    rotation_deg: float = 45.0
    any_rotation_share: float = 0.25
    tilt_deg: float = 45.0
    scale_min: float = 0.6  # pixels of a view for one of the texture
    scale_max: float = 1.6
    shift: float = 0.15  # of the point looked at, as a share of the texture's size
    focal_min: float = 0.8  # as shares of the view's width
    focal_max: float = 1.3
    near_share: float = 0.5  # views that are a small step from another one of the same scene
    near_rotation_deg: float = 12.0
    near_tilt_deg: float = 10.0
    near_shift: float = 0.06
    near_scale: float = 1.15

    def check(self, where: str) -> None:
        check_field(0 < self.tilt_deg <= 50, where, "tilt_deg", self.tilt_deg,
                    "degrees in (0, 50], so that no ray misses the ground")
        check_field(0 < self.relief_max + self.building_height_max + self.moving_height_max < 0.8,
                    where, "relief_max", self.relief_max,
                    "a camera above everything: less than 0.8 with the buildings' height")
        check_field(0 < self.scale_min <= self.scale_max, where, "scale_min", self.scale_min,
                    "0 < scale_min <= scale_max")


@dataclass(frozen=True)
class Pose:
    """Where a camera looks: as drawn, before it becomes a matrix."""

    target: np.ndarray  # (2,) on the ground
    turn_rad: float
    tilt_rad: float
    tilt_direction_rad: float
    scale: float  # pixels of the view for one of the texture


def read_height_maps(folder: str | Path) -> list[np.ndarray]:
    """All height maps (h, w) float32 of a folder of 16-bit PNG files, each from 0 to 1."""
    maps = []
    for path in sorted(Path(folder).glob("*.png")):
        heights = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        if heights is None or heights.dtype != np.uint16 or heights.ndim != 2:
            raise TrainingError(f"{path}: found no 16-bit grey image, expected heights")
        maps.append(heights.astype(np.float32) / 65535)
    if not maps:
        raise TrainingError(f"{folder}: found no *.png, expected height maps")
    return maps


def make_terrain(texture: np.ndarray, paint: np.ndarray, maps: list[np.ndarray], altitude: float,
                 rng: np.random.Generator, config: TerrainConfig) -> Terrain:
    """A terrain under the photograph `texture`; moving things are cut out of `paint`."""
    size = tuple(int(math.ceil(side / config.cell)) + 1 for side in texture.shape)
    relief = np.zeros(size, np.float32)
    if rng.random() >= config.flat_share:
        highest = rng.uniform(0.02, config.relief_max) * altitude
        relief += highest * _relief(maps[rng.integers(len(maps))], size, rng, config)
    heights = relief.copy()
    for _ in range(rng.integers(0, config.buildings_max + 1)):
        mask = _rectangle(size, config.building_side_px, config.cell, rng)
        if mask.any():
            roof = np.median(heights[mask]) + rng.uniform(
                0.02, config.building_height_max) * altitude
            heights[mask] = np.minimum(roof, (config.relief_max + config.building_height_max)
                                       * altitude)
    # Walls are steps between cells: their slopes are those of the grid, and say nothing of light.
    wall = np.hypot(*np.gradient(heights - relief, config.cell)) > _STEEP
    shade = _shade(relief, config.cell, rng) * np.where(wall, rng.uniform(0.5, 1.0), 1.0)
    paint = cv2.resize(paint, texture.shape[::-1], interpolation=cv2.INTER_AREA)
    return Terrain(heights, config.cell, texture, shade.astype(np.float32),
                   np.zeros(size, np.uint8), paint)


def with_moving_things(terrain: Terrain, altitude: float, rng: np.random.Generator,
                       config: TerrainConfig) -> Terrain:
    """The terrain at another moment: cars and the like stand somewhere else."""
    heights, moving = terrain.heights.copy(), terrain.moving.copy()
    for _ in range(rng.integers(0, config.moving_max + 1)):
        mask = _rectangle(heights.shape, config.moving_side_px, config.cell, rng)
        if mask.any():
            heights[mask] = (np.median(terrain.heights[mask])
                             + rng.uniform(0.005, config.moving_height_max) * altitude)
            moving[mask] = 1
    return replace(terrain, heights=heights, moving=moving)


def _relief(heights: np.ndarray, size: tuple[int, int], rng: np.random.Generator,
            config: TerrainConfig) -> np.ndarray:
    """A random crop of a height map, turned, at the size wanted and from 0 to 1."""
    side = int(rng.integers(config.crop_min, min(config.crop_max, *heights.shape) + 1))
    top, left = (rng.integers(0, full - side + 1) for full in heights.shape)
    crop = np.rot90(heights[top:top + side, left:left + side], rng.integers(4))
    crop = cv2.resize(np.ascontiguousarray(crop), size[::-1], interpolation=cv2.INTER_CUBIC)
    return (crop - crop.min()) / max(float(crop.max() - crop.min()), 1e-6)


def _rectangle(size: tuple[int, int], side_px: tuple, cell: float, rng: np.random.Generator
               ) -> np.ndarray:
    """Mask (h, w) of a turned rectangle somewhere."""
    centre = rng.uniform(0, 1, 2) * (size[1], size[0])
    sides = rng.uniform(*side_px, 2) / cell
    corners = cv2.boxPoints((centre.tolist(), sides.tolist(), rng.uniform(0, 90)))
    mask = np.zeros(size, np.uint8)
    cv2.fillConvexPoly(mask, np.rint(corners).astype(np.int32), 1)
    return mask > 0


def _shade(heights: np.ndarray, cell: float, rng: np.random.Generator) -> np.ndarray:
    """Light on the surface from a random sun, 1 on level ground, of matt reflection."""
    slope_y, slope_x = np.gradient(heights, cell)
    azimuth, elevation = rng.uniform(0, 2 * math.pi), rng.uniform(0.6, 1.4)
    across = np.array([math.cos(azimuth), math.sin(azimuth)]) * math.cos(elevation)
    lit = (math.sin(elevation) - slope_x * across[0] - slope_y * across[1]) / np.sqrt(
        1 + slope_x**2 + slope_y**2)
    return (0.4 + 0.6 * np.clip(lit / math.sin(elevation), 0, 1.5)).astype(np.float32)


def draw_pose(texture_shape: tuple[int, int], rng: np.random.Generator, config: TerrainConfig
              ) -> Pose:
    """Any view of the ground."""
    size = np.array(texture_shape[::-1])
    limit = 180.0 if rng.random() < config.any_rotation_share else config.rotation_deg
    return Pose(size * (0.5 + rng.uniform(-config.shift, config.shift, 2)),
                math.radians(rng.uniform(-limit, limit)),
                math.radians(config.tilt_deg) * math.sqrt(rng.random()),
                rng.uniform(0, 2 * math.pi),
                math.exp(rng.uniform(math.log(config.scale_min), math.log(config.scale_max))))


def near_pose(pose: Pose, texture_shape: tuple[int, int], rng: np.random.Generator,
              config: TerrainConfig) -> Pose:
    """A view a small step away, as of a following frame."""
    tilt = pose.tilt_rad + math.radians(config.near_tilt_deg) * rng.uniform(-1, 1)
    turn = math.radians(config.near_rotation_deg) * rng.uniform(-1, 1)
    step = config.near_shift * max(texture_shape) * rng.uniform(-1, 1, 2)
    scale = pose.scale * config.near_scale ** rng.uniform(-1, 1)
    return Pose(pose.target + step, pose.turn_rad + turn,
                min(max(tilt, 0.0), math.radians(config.tilt_deg)),
                pose.tilt_direction_rad + 0.5 * rng.uniform(-1, 1),
                min(max(scale, config.scale_min), config.scale_max))


def look_at(pose: Pose, ground_height: float, focal_px: float, width: int, height: int) -> Camera:
    """The camera that sees `target` in its centre, at the scale wanted."""
    direction = pose.tilt_direction_rad
    axis = np.array([math.cos(direction), math.sin(direction), 0.0])
    tilt, _ = cv2.Rodrigues(axis * pose.tilt_rad)
    turn, _ = cv2.Rodrigues(np.array([0.0, 0.0, pose.turn_rad]))
    rotation = turn @ tilt
    target = np.array([*pose.target, -ground_height])
    distance = focal_px / pose.scale
    translation = np.array([0, 0, distance]) - rotation @ target
    return Camera(pinhole(focal_px, width, height), np.c_[rotation, translation], width, height)
