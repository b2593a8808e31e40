"""Scenes: several views of one place, and where each view's points lie in the others."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from deepuav_training.config import check_field
from deepuav_training.data.faces import render_faces
from deepuav_training.data.homography import (HomographyConfig, inside, sample_homography,
                                              warp_image, warp_points)
from deepuav_training.data.photometric import PhotometricConfig, degrade
from deepuav_training.data.render import (Camera, Rendering, render, visible_points,
                                          world_points)
from deepuav_training.data.rooms import (RoomConfig, camera_at, draw_viewpoint, make_room,
                                         moving_faces, other_viewpoint)
from deepuav_training.data.streets import (StreetConfig, draw_look, make_street, next_look,
                                           passing_faces)
from deepuav_training.data.terrain import (TerrainConfig, draw_pose, look_at, make_terrain,
                                           near_pose, with_moving_things)

_VIEW = HomographyConfig(rotation_deg=45, any_rotation_share=0.25, scale_min=0.6, scale_max=1.8,
                         perspective=0.25, translation=0.15)
_STEP = HomographyConfig(rotation_deg=12, any_rotation_share=0.0, scale_min=0.85, scale_max=1.18,
                         perspective=0.08, translation=0.06)

# Points (N, 2) of view a, in pixels, to view b, given as (points, a, b); NaN where b sees them not.
Transfer = Callable[[np.ndarray, int, int], np.ndarray]


@dataclass(frozen=True)
class SceneConfig:
    """How scenes are drawn."""

    views: int = 6  # of a scene
    width: int = 480  # pixels of a view
    height: int = 360
    flat_share: float = 0.4  # scenes that are a photograph seen by homographies
    room_share: float = 0.0  # scenes that are a room or hall
    street_share: float = 0.0  # scenes that are a street; the rest are terrains from above
    near_share: float = 0.4  # of a flat scene's views that are a small step from another
    view: HomographyConfig = _VIEW  # of a flat scene's views, from the photograph
    step: HomographyConfig = _STEP
    terrain: TerrainConfig = field(default_factory=TerrainConfig)
    room: RoomConfig = field(default_factory=RoomConfig)
    street: StreetConfig = field(default_factory=StreetConfig)
    photometric: PhotometricConfig = field(default_factory=PhotometricConfig)

    def check(self, where: str) -> None:
        check_field(self.views >= 2, where, "views", self.views, "at least 2")
        for name, others in (("room_share", self.flat_share),
                             ("street_share", self.flat_share + self.room_share)):
            check_field(0 <= getattr(self, name) <= 1 - others <= 1, where, name,
                        getattr(self, name), "a share of at most what the ones before leave")
        for name in ("width", "height"):
            side = getattr(self, name)
            check_field(side > 0 and side % 8 == 0, where, name, side, "a positive multiple of 8")


@dataclass(frozen=True)
class Scene:
    """Views of one place."""

    images: list[np.ndarray]  # (H, W) uint8, degraded each on its own
    transfer: Transfer


def make_scene(photo: np.ndarray, paint: np.ndarray, maps: list[np.ndarray],
               rng: np.random.Generator, config: SceneConfig) -> Scene:
    """A random scene of a photograph; `paint` is another one, and `maps` height maps."""
    kind = rng.random()
    if kind < config.flat_share:
        scene = flat_scene(photo, rng, config)
    elif kind < config.flat_share + config.room_share:
        scene = room_scene(photo, paint, rng, config)
    elif kind < config.flat_share + config.room_share + config.street_share:
        scene = street_scene(photo, paint, rng, config)
    else:
        scene = terrain_scene(photo, paint, maps, rng, config)
    return Scene([degrade(image, rng, config.photometric) for image in scene.images],
                 scene.transfer)


def flat_scene(photo: np.ndarray, rng: np.random.Generator, config: SceneConfig) -> Scene:
    """Views of a photograph through homographies; points off the photograph are in no view."""
    width, height = config.width, config.height
    full_height, full_width = photo.shape
    middle = np.array([[1, 0, 0.5 * (width - full_width)], [0, 1, 0.5 * (height - full_height)],
                       [0, 0, 1]])
    from_photo = []
    for _ in range(config.views):
        if from_photo and rng.random() < config.near_share:
            step = sample_homography(rng, config.step, width, height)
            from_photo.append(step @ from_photo[rng.integers(len(from_photo))])
        else:
            from_photo.append(sample_homography(rng, config.view, width, height) @ middle)

    def transfer(points: np.ndarray, a: int, b: int) -> np.ndarray:
        on_photo = warp_points(np.linalg.inv(from_photo[a]), points)
        moved = warp_points(from_photo[b], on_photo)
        seen = inside(on_photo, full_width, full_height) & inside(moved, width, height)
        return np.where(seen[:, None], moved, np.nan)

    return Scene([warp_image(photo, h, width, height)[0] for h in from_photo], transfer)


def terrain_scene(photo: np.ndarray, paint: np.ndarray, maps: list[np.ndarray],
                  rng: np.random.Generator, config: SceneConfig) -> Scene:
    """Views of a terrain under a photograph, with parallax, occlusion and moving things."""
    c = config.terrain
    poses = [draw_pose(photo.shape, rng, c)]
    while len(poses) < config.views:
        poses.append(near_pose(poses[rng.integers(len(poses))], photo.shape, rng, c)
                     if rng.random() < c.near_share else draw_pose(photo.shape, rng, c))
    focal = rng.uniform(c.focal_min, c.focal_max) * config.width
    altitude = min(focal / pose.scale * np.cos(pose.tilt_rad) for pose in poses)
    terrain = make_terrain(photo, paint, maps, altitude, rng, c)
    ground = float(np.median(terrain.heights))
    cameras = [look_at(pose, ground, focal, config.width, config.height) for pose in poses]
    renderings = [render(with_moving_things(terrain, altitude, rng, c), camera)
                  for camera in cameras]
    return rendered_scene(renderings, cameras)


def room_scene(photo: np.ndarray, paint: np.ndarray, rng: np.random.Generator,
               config: SceneConfig) -> Scene:
    """Views from within a room, each of nearly the same as an earlier one."""
    c = config.room
    room = make_room(photo, paint, rng, c)
    views = [draw_viewpoint(room, rng, c)]
    while len(views) < config.views:
        views.append(other_viewpoint(views[rng.integers(len(views))], room, rng, c))
    focal = rng.uniform(*c.focal) * config.width
    cameras = [camera_at(view, focal, config.width, config.height) for view in views]
    renderings = [render_faces(room.faces + moving_faces(room, rng, c), camera)
                  for camera in cameras]
    return rendered_scene(renderings, cameras)


def street_scene(photo: np.ndarray, paint: np.ndarray, rng: np.random.Generator,
                 config: SceneConfig) -> Scene:
    """Views along a street, each of nearly the same as an earlier one."""
    c = config.street
    street = make_street(photo, paint, rng, c)
    views = [draw_look(street, rng, c)]
    while len(views) < config.views:
        views.append(next_look(views[rng.integers(len(views))], street, rng, c))
    focal = rng.uniform(*c.focal) * config.width
    cameras = [camera_at(view, focal, config.width, config.height) for view in views]
    renderings = [render_faces(street.place.faces + passing_faces(street, rng, c), camera)
                  for camera in cameras]
    return rendered_scene(renderings, cameras)


def rendered_scene(renderings: list[Rendering], cameras: list[Camera]) -> Scene:
    """Correspondences by depth: where a point is hidden or on a moving thing there is none."""

    def transfer(points: np.ndarray, a: int, b: int) -> np.ndarray:
        world = world_points(renderings[a], cameras[a], points)
        still = ~_touches(renderings[a], points)
        return np.where(still[:, None], visible_points(renderings[b], cameras[b], world), np.nan)

    return Scene([rendering.image for rendering in renderings], transfer)


def _touches(rendering: Rendering, points: np.ndarray) -> np.ndarray:
    """Mask (N,) of the points (N, 2) on a moving thing."""
    column, row = np.rint(points).astype(int).T
    return rendering.moving[row, column]
