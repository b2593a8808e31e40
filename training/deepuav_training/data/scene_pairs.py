"""Training samples of two rendered views of a scene, with parallax and occlusion."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deepuav_training.config import check_field
from deepuav_training.data.pairs import PairConfig, PairSource, Sample, known_cells, make_sample
from deepuav_training.data.photometric import degrade
from deepuav_training.labelled_scenes import LabelledScene, load_labelled_scene


@dataclass(frozen=True)
class ScenePairConfig:
    """Which rendered scenes are drawn from, and how often."""

    scenes: str = ""  # the configuration that labelled scenes were made with; empty: none
    share: float = 0.5  # of the samples
    least_shared: int = 48  # points of the first view that the second must show

    def check(self, where: str) -> None:
        check_field(0 < self.share < 1, where, "share", self.share, "a share in (0, 1)")
        check_field(self.least_shared > 0, where, "least_shared", self.least_shared, "at least 1")


class ScenePairSource:
    """Draws samples; a sample depends on the seed and its number alone."""

    def __init__(self, paths: list[Path], least_shared: int, config: PairConfig, seed: int):
        """`paths` are files of labelled scenes."""
        self._paths, self._least, self._config, self._seed = paths, least_shared, config, seed

    def __len__(self) -> int:
        return len(self._paths)

    def draw(self, number: int) -> Sample:
        """The sample of this running number: every scene once, then all again in a new order."""
        epoch, place = divmod(number, len(self._paths))
        order = np.random.default_rng([self._seed, epoch, 1]).permutation(len(self._paths))
        rng = np.random.default_rng([self._seed, epoch, place, 1])
        scene = load_labelled_scene(self._paths[order[place]])
        return self._make(scene, *choose_pair(scene, self._least, rng), rng)

    def _make(self, scene: LabelledScene, a: int, b: int, rng: np.random.Generator) -> Sample:
        c, labels = self._config, scene.labels[a]
        height, width = scene.images.shape[1:]
        images = [degrade(scene.images[view], rng, c.photometric) for view in (a, b)]
        points = [points.astype(np.float64) for points in (labels.points, scene.seen_at[a][b])]
        known = [known_cells(np.eye(3), width, height, c.label_border), scene.shared[a, b]]
        return make_sample(images, points, known, labels, rng, c)


def choose_pair(scene: LabelledScene, least_shared: int, rng: np.random.Generator
                ) -> tuple[int, int]:
    """Any two views of which the second shows so many points of the first; else the best two."""
    counts = scene.counts()
    enough = np.argwhere(counts >= min(least_shared, counts.max()))
    a, b = enough[rng.integers(len(enough))]
    return int(a), int(b)


def mixed_draw(flat: PairSource, scenes: ScenePairSource, share: float) -> Callable[[int], Sample]:
    """Draws from `scenes` in this share of the numbers, evenly spread, and from `flat` otherwise."""

    def draw(number: int) -> Sample:
        before, after = int(number * share), int((number + 1) * share)
        return scenes.draw(before) if after > before else flat.draw(number - before)

    return draw
