"""Pairs of views as the matcher sees them in training, with what is true of their key points."""

from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deepuav_training.config import check_field
from deepuav_training.errors import TrainingError
from deepuav_training.scene_cache import SceneFeatures, load_scene, scene_path

UNMATCHED = -1  # no key point of the other view shows the same
UNKNOWN = -2  # too near to one that may


@dataclass(frozen=True)
class MatchConfig:
    """How pairs are drawn from scenes."""

    points: int = 320  # of a view, a random choice
    match_px: float = 3.0  # key points that lie no farther apart show the same
    apart_px: float = 5.0  # those without another within this have no match
    least_matches: int = 8  # of a pair
    pairs_of_scene: int = 4  # drawn one after the other, before the next scene is read

    def check(self, where: str) -> None:
        check_field(self.points > 0, where, "points", self.points, "at least 1")
        check_field(0 < self.match_px <= self.apart_px, where, "match_px", self.match_px,
                    "0 < match_px <= apart_px")
        check_field(self.pairs_of_scene > 0, where, "pairs_of_scene", self.pairs_of_scene,
                    "at least 1")


@dataclass(frozen=True)
class MatchSample:
    """Two views with K key points each; index 0 and 1 are the views."""

    keypoints: np.ndarray  # (2, K, 2) float32, as the network takes them
    scores: np.ndarray  # (2, K) float32
    descriptors: np.ndarray  # (2, K, C) float32
    match: np.ndarray  # (2, K) int64: index in the other view, UNMATCHED or UNKNOWN


def normalise(points: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Pixels (..., 2) to (p - size / 2) / (longer side / 2); size is (width, height)."""
    return ((points - 0.5 * np.asarray(size)) / (0.5 * np.max(size))).astype(np.float32)


def true_matches(points0: np.ndarray, points1: np.ndarray, seen0: np.ndarray, seen1: np.ndarray,
                 config: MatchConfig) -> tuple[np.ndarray, np.ndarray]:
    """For each key point its match's index, UNMATCHED or UNKNOWN: (N,) and (M,) int64.

    Args:
        points0: (N, 2) in view 0; points1: (M, 2) in view 1.
        seen0: (N, 2), where view 1 shows points0, NaN where it does not; seen1: (M, 2).
    """
    distance = np.maximum(_distance(seen0, points1), _distance(seen1, points0).T)
    best0, best1 = distance.argmin(axis=1), distance.argmin(axis=0)
    mutual = best1[best0] == np.arange(len(points0))
    matched = mutual & (distance.min(axis=1) <= config.match_px)
    match0 = _without_match(seen0, points1, config.apart_px)
    match1 = _without_match(seen1, points0, config.apart_px)
    match0[matched] = best0[matched]
    match1[best0[matched]] = np.flatnonzero(matched)
    return match0, match1


def _distance(seen: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N, M) between where points are seen (N, 2) and points (M, 2); infinite for NaN."""
    return np.nan_to_num(np.linalg.norm(seen[:, None] - points[None], axis=2), nan=np.inf)


def _without_match(seen: np.ndarray, points: np.ndarray, apart_px: float) -> np.ndarray:
    """UNMATCHED for those with none of `points` near where they are seen, else UNKNOWN."""
    nearest = _distance(seen, points).min(axis=1)
    return np.where(nearest > apart_px, UNMATCHED, UNKNOWN).astype(np.int64)


class MatchSource:
    """Draws pairs; a pair depends on the seed, its running number and the scenes alone."""

    def __init__(self, cache: str | Path, count: int, config: MatchConfig, seed: int):
        """`cache` holds scenes 0 to count - 1; those missing are left out."""
        self._paths = [path for index in range(count)
                       if (path := scene_path(cache, index)).exists()]
        if not self._paths:
            raise TrainingError(f"{cache}: found no scenes, expected those of cache_scenes")
        self._config, self._seed = config, seed
        self._recent: OrderedDict[Path, SceneFeatures] = OrderedDict()

    def __len__(self) -> int:
        return len(self._paths)

    @property
    def pairs_of_scene(self) -> int:
        """Running numbers that far apart are of different scenes."""
        return self._config.pairs_of_scene

    def draw(self, number: int) -> MatchSample:
        """The pair of this running number: each scene gives some, then all again."""
        epoch, place = divmod(number // self._config.pairs_of_scene, len(self._paths))
        order = np.random.default_rng([self._seed, epoch]).permutation(len(self._paths))
        scene = self._scene(self._paths[order[place]])
        rng = np.random.default_rng([self._seed, number])
        pairs = rng.permutation([(a, b) for a in range(len(scene.points))
                                 for b in range(len(scene.points)) if a != b])
        for a, b in pairs:
            sample = make_sample(scene, a, b, self._config, rng)
            if (sample.match[0] >= 0).sum() >= self._config.least_matches:
                break
        return sample

    def _scene(self, path: Path) -> SceneFeatures:
        if path not in self._recent:
            self._recent[path] = load_scene(path)
            if len(self._recent) > 4:
                self._recent.popitem(last=False)
        return self._recent[path]


def make_sample(scene: SceneFeatures, a: int, b: int, config: MatchConfig,
                rng: np.random.Generator) -> MatchSample:
    """Views a and b, of each a random choice among a random number of its best key points."""
    total = scene.points.shape[1]
    count = min(config.points, total)
    chosen = [rng.permutation(rng.integers(count, total + 1))[:count] for _ in range(2)]
    points = [scene.points[view, rows] for view, rows in zip((a, b), chosen, strict=True)]
    match = true_matches(*points, scene.seen_at[a, b, chosen[0]], scene.seen_at[b, a, chosen[1]],
                         config)
    return MatchSample(
        np.stack([normalise(p, scene.size) for p in points]),
        np.stack([scene.scores[view, rows] for view, rows in zip((a, b), chosen, strict=True)]),
        np.stack([scene.descriptors[view, rows]
                  for view, rows in zip((a, b), chosen, strict=True)]),
        np.stack(match))
