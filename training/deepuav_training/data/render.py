"""Pictures of a terrain with true depth, by following each pixel's ray to the ground.

World axes: x and y along the ground in pixels of its texture, z down into the ground; a height is
-z. A camera that looks straight down without a turn has the world's axes.
"""

from dataclasses import dataclass

import cv2
import numpy as np

_BISECTIONS = 9
_STEP_CELLS = 1.5  # length of a ray's step over the ground
_FEWEST_STEPS, _MOST_STEPS = 12, 128
_EDGE_SHARE = 0.03  # depth that differs more from pixel to pixel belongs to two surfaces
_SAME_SHARE = 0.01  # depths that differ less are of the same surface
_WALL_SHIFT = 0.7  # pixels of texture by which it moves on along x and y for a height of one


@dataclass(frozen=True)
class Terrain:
    """A ground with a height everywhere; beyond its edges it is mirrored."""

    heights: np.ndarray  # (h, w) float32, pixels of the texture
    cell: float  # pixels of the texture between two heights
    texture: np.ndarray  # (H, W) uint8
    shade: np.ndarray  # (h, w) float32, share of the light that the surface gets
    moving: np.ndarray  # (h, w) uint8, not 0 where something stands only in this view
    paint: np.ndarray  # (H, W) uint8, texture of the moving things


@dataclass(frozen=True)
class Camera:
    """A pinhole camera."""

    matrix: np.ndarray  # (3, 3)
    camera_from_world: np.ndarray  # (3, 4)
    width: int
    height: int

    @property
    def centre(self) -> np.ndarray:
        """Position in the world (3,)."""
        return -self.camera_from_world[:, :3].T @ self.camera_from_world[:, 3]


def pinhole(focal_px: float, width: int, height: int) -> np.ndarray:
    """The matrix (3, 3) of a camera whose axis goes through the picture's middle."""
    return np.array([[focal_px, 0, 0.5 * (width - 1)], [0, focal_px, 0.5 * (height - 1)],
                     [0, 0, 1]])


@dataclass(frozen=True)
class Rendering:
    """What a camera sees of a terrain."""

    image: np.ndarray  # (H, W) uint8
    depth: np.ndarray  # (H, W) float32 along the optical axis
    moving: np.ndarray  # (H, W) bool


def render(terrain: Terrain, camera: Camera) -> Rendering:
    """Renders a camera above all heights, of which every ray goes down."""
    rays = pixel_rays(camera)
    along = intersect(terrain, camera.centre, rays)
    x, y, z = (o + along * ray for o, ray in zip(camera.centre.astype(np.float32), rays,
                                                 strict=True))
    image, moving = _colours(terrain, x, y, -z, _pixel_size(camera, along))
    return Rendering(image, along, moving)


def pixel_rays(camera: Camera) -> np.ndarray:
    """Directions (3, H, W) float32 in the world of all pixels, of length 1 along the axis."""
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    pixels = np.stack([u.ravel(), v.ravel(), np.ones(u.size)])
    rays = camera.camera_from_world[:, :3].T @ np.linalg.inv(camera.matrix) @ pixels
    return rays.reshape(3, camera.height, camera.width).astype(np.float32)


def intersect(terrain: Terrain, origin: np.ndarray, rays: np.ndarray) -> np.ndarray:
    """How far along each ray (3, H, W) from `origin` (3,) the first ground lies, (H, W) float32."""
    top, bottom = float(terrain.heights.max()) + 1e-2, float(terrain.heights.min()) - 1e-2
    near, far = ((np.float32(-level - origin[2]) / rays[2]) for level in (top, bottom))
    across = float((np.hypot(rays[0], rays[1]) * (far - near)).max())
    steps = int(np.clip(across / (_STEP_CELLS * terrain.cell), _FEWEST_STEPS, _MOST_STEPS))
    above, below = near, far
    found = np.zeros(near.shape, bool)
    for step in range(1, steps):
        along = near + (far - near) * np.float32(step / steps)
        hit = _is_below(terrain, origin, rays, along)
        below = np.where(hit & ~found, along, below)
        found |= hit
        above = np.where(found, above, along)
        if found.all():
            break
    for _ in range(_BISECTIONS):
        middle = np.float32(0.5) * (above + below)
        hit = _is_below(terrain, origin, rays, middle)
        below, above = np.where(hit, middle, below), np.where(hit, above, middle)
    return np.float32(0.5) * (above + below)


def _is_below(terrain: Terrain, origin: np.ndarray, rays: np.ndarray, along: np.ndarray
              ) -> np.ndarray:
    scale = np.float32(1 / terrain.cell)
    x, y = (np.float32(origin[i]) * scale + (along * scale) * rays[i] for i in (0, 1))
    return -(np.float32(origin[2]) + along * rays[2]) < sample(terrain.heights, x, y)


def sample(table: np.ndarray, x: np.ndarray, y: np.ndarray, method: int = cv2.INTER_LINEAR
           ) -> np.ndarray:
    """Values of `table` at (x, y), both of one shape (H, W); mirrored beyond the edges."""
    return cv2.remap(table, x.astype(np.float32, copy=False), y.astype(np.float32, copy=False),
                     method, borderMode=cv2.BORDER_REFLECT_101)


def _pixel_size(camera: Camera, along: np.ndarray) -> float:
    """How many pixels of the texture one of the picture covers, the median."""
    return float(np.median(along) / camera.matrix[0, 0])


def _colours(terrain: Terrain, x: np.ndarray, y: np.ndarray, height: np.ndarray, pixel_size: float
             ) -> tuple[np.ndarray, np.ndarray]:
    """The picture (H, W) uint8 of ground points, and where it shows moving things."""
    cells = x / terrain.cell, y / terrain.cell
    moving = sample(terrain.moving, *cells, cv2.INTER_NEAREST) > 0
    # The texture moves on with the height, so that walls are not drawn out of one line of it.
    u, v = x + _WALL_SHIFT * height, y + _WALL_SHIFT * height
    texture, paint = terrain.texture, terrain.paint
    while pixel_size > 1.4:
        smaller = (texture.shape[1] // 2, texture.shape[0] // 2)
        texture, paint = (cv2.resize(t, smaller, interpolation=cv2.INTER_AREA)
                          for t in (texture, paint))
        pixel_size /= 2
    # Of odd sides halves are not half.
    u, v = ((at + 0.5) * (small / full) - 0.5 for at, small, full in (
        (u, texture.shape[1], terrain.texture.shape[1]),
        (v, texture.shape[0], terrain.texture.shape[0])))
    colour = np.where(moving, sample(paint, u, v), sample(texture, u, v))
    lit = colour * sample(terrain.shade, *cells)
    return np.clip(np.rint(lit), 0, 255).astype(np.uint8), moving


def world_points(rendering: Rendering, camera: Camera, points: np.ndarray) -> np.ndarray:
    """World coordinates (N, 3) of pixels (N, 2); those at an edge belong to the nearer surface."""
    depth = rendering.depth
    nearest = cv2.erode(depth, np.ones((3, 3)))
    farthest = cv2.dilate(depth, np.ones((3, 3)))
    x, y = points[:, :1], points[:, 1:]
    smooth = sample(depth, x, y)[:, 0]
    front, back = (sample(t, x, y, cv2.INTER_NEAREST)[:, 0] for t in (nearest, farthest))
    along = np.where(back - front > _EDGE_SHARE * front, front, smooth)
    rays = (np.linalg.inv(camera.matrix) @ np.c_[points, np.ones(len(points))].T)
    return camera.centre + (camera.camera_from_world[:, :3].T @ (along * rays)).T


def project(camera: Camera, world: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (N, 2) of world points (N, 3), and their depths (N,); NaN pixels behind the camera."""
    local = world @ camera.camera_from_world[:, :3].T + camera.camera_from_world[:, 3]
    depth = np.where(local[:, 2] > 1e-6, local[:, 2], np.nan)
    return (local @ camera.matrix.T)[:, :2] / depth[:, None], local[:, 2]


def visible_points(rendering: Rendering, camera: Camera, world: np.ndarray) -> np.ndarray:
    """Pixels (N, 2) at which a camera sees world points (N, 3); NaN where it does not."""
    pixels, depth = project(camera, world)
    with np.errstate(invalid="ignore"):
        inside = ((pixels >= 0) & (pixels <= (camera.width - 1, camera.height - 1))).all(axis=1)
    column, row = np.where(inside[:, None], np.rint(pixels), 0).astype(int).T
    seen = np.zeros(len(world), bool)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            found = rendering.depth[np.clip(row + dy, 0, camera.height - 1),
                                    np.clip(column + dx, 0, camera.width - 1)]
            seen |= np.abs(found - depth) < _SAME_SHARE * depth
    seen &= inside & ~rendering.moving[row, column]
    return np.where(seen[:, None], pixels, np.nan)
