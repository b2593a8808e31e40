"""Views: the crops of the photographs that teacher and student are shown, evenly per source."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from deepuav_training.config import check_field
from deepuav_training.data.homography import resize_matrix, translation_matrix
from deepuav_training.data.manifest import Photograph
from deepuav_training.errors import TrainingError


@dataclass(frozen=True)
class ViewConfig:
    """How crops are drawn."""

    count: int = 4000  # views in all
    width: int = 320  # pixels of a view
    height: int = 240
    shrink_max: float = 2.0  # a view's pixel covers 1 to this many pixels of the photograph
    seed: int = 1

    def check(self, where: str) -> None:
        check_field(self.count > 0, where, "count", self.count, "at least 1")
        check_field(self.width > 0 and self.width % 8 == 0, where, "width", self.width,
                    "a positive multiple of 8")
        check_field(self.height > 0 and self.height % 8 == 0, where, "height", self.height,
                    "a positive multiple of 8")
        check_field(self.shrink_max >= 1, where, "shrink_max", self.shrink_max, "at least 1")


@dataclass(frozen=True)
class View:
    """A crop of a photograph, resampled to the size that networks are trained at."""

    index: int
    photograph: Photograph
    view_from_photo: np.ndarray  # (3, 3) in pixels


def list_views(photographs: list[Photograph], config: ViewConfig, root: str | Path) -> list[View]:
    """Lists the views in an order of which every prefix is even over the sources.

    Sources take turns; within a source its photographs take turns in a shuffled order, each time
    with a new crop.
    """
    rng = np.random.default_rng(config.seed)
    by_source = {}
    for photo in photographs:
        by_source.setdefault(photo.source, []).append(photo)
    orders = {source: rng.permutation(len(by_source[source])) for source in sorted(by_source)}
    sizes = {}
    views = []
    sources = sorted(by_source)
    for index in range(config.count):
        source = sources[index % len(sources)]
        turn = index // len(sources)
        order = orders[source]
        photo = by_source[source][order[turn % len(order)]]
        if photo.file not in sizes:
            sizes[photo.file] = load_grey(Path(root) / photo.file).shape[::-1]
        crop_rng = np.random.default_rng([config.seed, index])
        views.append(View(index, photo, _random_crop(crop_rng, *sizes[photo.file], config)))
    return views


def load_grey(path: Path) -> np.ndarray:
    """Reads an image as (h, w) uint8."""
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise TrainingError(f"{path}: cannot be decoded, expected an image")
    return image


def _random_crop(rng: np.random.Generator, photo_width: int, photo_height: int,
                 config: ViewConfig) -> np.ndarray:
    largest = min(photo_width / config.width, photo_height / config.height, config.shrink_max)
    smallest = min(1.0, largest)
    shrink = rng.uniform(smallest, largest)
    left = rng.uniform(0, photo_width - shrink * config.width)
    top = rng.uniform(0, photo_height - shrink * config.height)
    return (resize_matrix(1 / shrink, 1 / shrink)
            @ translation_matrix(np.array([-round(left), -round(top)])))
