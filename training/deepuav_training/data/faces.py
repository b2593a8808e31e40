"""Pictures of textured parallelograms with true depth."""

from dataclasses import dataclass

import cv2
import numpy as np

from deepuav_training.data.render import Camera, Rendering

_LEVELS = 4  # of a face's texture, each half as large as the one before
LEAST_SIDE_PX = 8  # of a texture
_NEAREST = 0.05  # depth: what is nearer to the camera is not drawn
_REMAP_LIMIT = 30000  # rows that remap takes at once


@dataclass(frozen=True)
class Face:
    """A textured parallelogram."""

    corner: np.ndarray  # (3,)
    along_u: np.ndarray  # (3,) edge along the texture's rows
    along_v: np.ndarray  # (3,) edge along its columns
    levels: tuple[np.ndarray, ...]  # texture (h, w) uint8 and its halves
    moving: bool


def halves(texture: np.ndarray) -> tuple[np.ndarray, ...]:
    """A texture (h, w) uint8 at the sizes that a face is drawn with."""
    levels = [texture]
    while len(levels) < _LEVELS and min(levels[-1].shape) >= 2 * LEAST_SIDE_PX:
        levels.append(cv2.resize(levels[-1], None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA))
    return tuple(levels)


def render_faces(faces: list[Face], camera: Camera) -> Rendering:
    """What a camera sees of faces; where there is none the depth is infinite."""
    shape = (camera.height, camera.width)
    nearness, owner = np.zeros(shape, np.float32), np.full(shape, -1, np.int32)
    projections = [_Projection.of(face, camera) for face in faces]
    for number, projection in enumerate(projections):
        if projection is None:
            continue
        window, closer = projection.window, projection.nearness()
        drawn = (closer > nearness[window]) & (closer < 1 / _NEAREST) & projection.covers()
        nearness[window][drawn] = closer[drawn]
        owner[window][drawn] = number
    image, moving = np.zeros(shape, np.uint8), np.zeros(shape, bool)
    for number in np.unique(owner[owner >= 0]):
        window = projections[number].window
        mine = owner[window] == number
        image[window][mine] = projections[number].colours(mine)
        moving[window][mine] = faces[number].moving
    with np.errstate(divide="ignore"):
        return Rendering(image, 1 / nearness, moving)


@dataclass(frozen=True)
class _Projection:
    """A face in the part of a picture that it may cover."""

    face: Face
    window: tuple[slice, slice]  # rows and columns
    share_from_pixel: np.ndarray  # (3, 3): pixels to shares of both edges, homogeneous
    nearness_of_pixel: np.ndarray  # (3,): 1 / depth of the plane is its product with (x, y, 1)

    @staticmethod
    def of(face: Face, camera: Camera) -> "_Projection | None":
        """None for a face that is behind the camera, seen along its plane, or off the picture."""
        turn, shift = camera.camera_from_world[:, :3], camera.camera_from_world[:, 3]
        local = np.stack([turn @ face.along_u, turn @ face.along_v, turn @ face.corner + shift],
                         axis=1)
        corners = local @ np.array([[0, 1, 0, 1], [0, 0, 1, 1], [1, 1, 1, 1]])
        normal = np.cross(local[:, 0], local[:, 1])
        offset = normal @ local[:, 2]
        if abs(offset) < 1e-6 * np.linalg.norm(normal) or (corners[2] < _NEAREST).all():
            return None
        window = _window(corners, camera)
        if window is None:
            return None
        inverse = np.linalg.inv(camera.matrix)
        return _Projection(face, window, np.linalg.inv(local) @ inverse,
                           normal @ inverse / offset)

    def _plane(self, weights: np.ndarray) -> np.ndarray:
        """The product of `weights` (3,) with (x, y, 1) in the window, float32."""
        rows, columns = self.window
        x, y = np.arange(columns.start, columns.stop), np.arange(rows.start, rows.stop)
        return ((weights[0] * x + weights[2])[None, :]
                + (weights[1] * y)[:, None]).astype(np.float32)

    def nearness(self) -> np.ndarray:
        """1 / depth; negative behind the camera."""
        return self._plane(self.nearness_of_pixel)

    def covers(self) -> np.ndarray:
        """Mask of the pixels whose rays hit the face."""
        u, v, w = (self._plane(row) for row in self.share_from_pixel)
        return (w > 0) & (u >= 0) & (u <= w) & (v >= 0) & (v <= w)

    def colours(self, mask: np.ndarray) -> np.ndarray:
        """Colours (N,) uint8 of a mask's pixels, from textures whose pixels are as large."""
        u, v, w = (self._plane(row)[mask] for row in self.share_from_pixel)
        height, width = self.face.levels[0].shape
        area = abs(np.linalg.det(self.share_from_pixel)) * width * height / w**3
        level = np.clip(np.rint(0.5 * np.log2(np.maximum(area, 1e-6))), 0,
                        len(self.face.levels) - 1)
        found = np.zeros(len(u), np.uint8)
        for number in np.unique(level).astype(int):
            texture, chosen = self.face.levels[number], level == number
            x, y = (share[chosen] / w[chosen] * side - 0.5 for share, side in (
                (u, texture.shape[1]), (v, texture.shape[0])))
            found[chosen] = _sample(texture, x, y)
        return found


def _window(corners: np.ndarray, camera: Camera) -> tuple[slice, slice] | None:
    """Rows and columns around corners (3, 4) in the camera's frame; None outside the picture."""
    if (corners[2] < _NEAREST).any():
        return slice(0, camera.height), slice(0, camera.width)
    pixels = (camera.matrix @ corners)[:2] / corners[2]
    most = (camera.width, camera.height)
    low = np.clip(np.floor(pixels.min(axis=1)), 0, most).astype(int)
    high = np.clip(np.ceil(pixels.max(axis=1)) + 1, 0, most).astype(int)
    if (high <= low).any():
        return None
    return slice(low[1], high[1]), slice(low[0], high[0])


def _sample(texture: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Values (N,) of a texture at positions (N,)."""
    parts = [cv2.remap(texture, x[k:k + _REMAP_LIMIT, None], y[k:k + _REMAP_LIMIT, None],
                       cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)[:, 0]
             for k in range(0, len(x), _REMAP_LIMIT)]
    return np.concatenate(parts)
