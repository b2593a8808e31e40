"""Pairs of views as the matcher sees them in training, with what is true of their key points."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deepuav_training.config import check_field
from deepuav_training.scene_cache import SceneFeatures, load_scene

UNMATCHED = -1  # no key point of the other view shows the same
UNKNOWN = -2  # too near to one that may
MISTAKABLE = -3  # unmatched, but one lies near where it is seen: the error that is made most
_LEAST_SEEN = 16  # key points from which a turn is told
_STEP_TURN_RAD = math.radians(15)
_STEP_SCALE = 1.25
_FAR_TURN_RAD = math.radians(60)


@dataclass(frozen=True)
class MatchConfig:
    """How pairs are drawn from scenes."""

    points: int = 320  # of a view
    more_points: int = 0  # of a view of some batches
    more_share: float = 0.0  # of those batches
    random_share: float = 0.2  # pairs with a random choice of the key points, not the best
    match_px: float = 2.0  # key points that lie no farther apart show the same
    apart_px: float = 5.0  # those without another within this have no match
    mistakable_px: float = 0.0  # of these, those with another within this are mistakable; 0: none
    least_matches: int = 8  # of a pair
    step_share: float = 0.4  # pairs that are a small step, as frames are
    turned_share: float = 0.2  # pairs that are turned far; the rest are any
    upside_share: float = 0.2  # views shown to the matcher as if the camera had been turned

    def check(self, where: str) -> None:
        check_field(self.points > 0, where, "points", self.points, "at least 1")
        check_field(0 < self.match_px <= self.apart_px, where, "match_px", self.match_px,
                    "0 < match_px <= apart_px")
        check_field(self.mistakable_px == 0 or self.mistakable_px > self.apart_px, where,
                    "mistakable_px", self.mistakable_px, "0 or more than apart_px")
        check_field(self.more_points > 0 or self.more_share == 0, where, "more_points",
                    self.more_points, "at least 1, where more_share is not 0")
        for name in ("more_share", "random_share", "step_share", "turned_share", "upside_share"):
            value = getattr(self, name)
            check_field(0 <= value <= 1, where, name, value, "a share in [0, 1]")
        check_field(self.step_share + self.turned_share <= 1, where, "turned_share",
                    self.turned_share, "at most 1 - step_share")


@dataclass(frozen=True)
class MatchSample:
    """Two views with K key points each; index 0 and 1 are the views."""

    keypoints: np.ndarray  # (2, K, 2) float32, as the network takes them
    scores: np.ndarray  # (2, K) float32
    descriptors: np.ndarray  # (2, K, C) of any length; int8, of a cached scene
    match: np.ndarray  # (2, K) int64: index in the other view, UNMATCHED, UNKNOWN or MISTAKABLE


def normalise(points: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Pixels (..., 2) to (p - size / 2) / (longer side / 2); size is (width, height)."""
    return ((points - 0.5 * np.asarray(size)) / (0.5 * np.max(size))).astype(np.float32)


def true_matches(points0: np.ndarray, points1: np.ndarray, seen0: np.ndarray, seen1: np.ndarray,
                 config: MatchConfig) -> tuple[np.ndarray, np.ndarray]:
    """For each key point its match's index, or why it has none: (N,) and (M,) int64.

    Args:
        points0: (N, 2) in view 0; points1: (M, 2) in view 1.
        seen0: (N, 2), where view 1 shows points0, NaN where it does not; seen1: (M, 2).
    """
    from0, from1 = _squared_distance(seen0, points1), _squared_distance(seen1, points0)
    squared = np.maximum(from0, from1.T)
    best0, best1 = squared.argmin(axis=1), squared.argmin(axis=0)
    rows = np.arange(len(points0))
    matched = (best1[best0] == rows) & (squared[rows, best0] <= config.match_px**2)
    match0, match1 = (_without_match(np.sqrt(distances.min(axis=1)), config)
                      for distances in (from0, from1))
    match0[matched] = best0[matched]
    match1[best0[matched]] = np.flatnonzero(matched)
    return match0, match1


def _without_match(nearest: np.ndarray, config: MatchConfig) -> np.ndarray:
    """What key points are whose nearest in the other view is that far off, if they are not matched."""
    return np.select([nearest <= config.apart_px, nearest <= config.mistakable_px],
                     [UNKNOWN, MISTAKABLE], UNMATCHED)


def _squared_distance(seen: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N, M) between where points are seen (N, 2) and points (M, 2); infinite for NaN."""
    seen = np.where(np.isnan(seen), np.inf, seen)
    x, y = (seen[:, axis, None] - points[None, :, axis] for axis in (0, 1))
    x *= x
    y *= y
    x += y
    return x


class MatchSource:
    """Draws pairs; a pair depends on the seed, its running number and the scenes alone."""

    def __init__(self, list_scenes: Callable[[], list[Path]], config: MatchConfig, seed: int,
                 relist_s: float = math.inf):
        """`list_scenes` gives files of save_scene: once, or again after so many seconds."""
        self._list, self._relist_s = list_scenes, relist_s
        self._config, self._seed = config, seed
        self._take_scenes()

    def __len__(self) -> int:
        return len(self._paths)

    def _take_scenes(self) -> None:
        self._paths, self._listed = self._list(), time.monotonic()

    def points_of_batch(self, step: int) -> int:
        """How many key points the views of a batch have."""
        c = self._config
        more = np.random.default_rng([self._seed, step, 1]).random() < c.more_share
        return c.more_points if more else c.points

    def draw(self, number: int, points: int | None = None) -> MatchSample:
        """The pair of this running number: each scene gives one, then all again.

        Args:
            number: from 0.
            points: of a view, if not as the configuration says.
        """
        if time.monotonic() - self._listed > self._relist_s:
            self._take_scenes()
        count = points or self._config.points
        epoch, place = divmod(number, len(self._paths))
        order = np.random.default_rng([self._seed, epoch]).permutation(len(self._paths))
        scene = load_scene(self._paths[order[place]])
        rng = np.random.default_rng([self._seed, number])
        for a, b in preferred_pairs(scene, self._config, rng):
            sample = make_sample(scene, a, b, self._config, rng, count)
            if (sample.match[0] >= 0).sum() >= self._config.least_matches:
                break
        return sample


def preferred_pairs(scene: SceneFeatures, config: MatchConfig, rng: np.random.Generator
                    ) -> list[tuple[int, int]]:
    """All pairs in a random order, but first those of a kind that is drawn by its share."""
    views = range(len(scene.points))
    pairs = [(a, b) for a in views for b in views if a != b]
    pairs = [pairs[k] for k in rng.permutation(len(pairs))]
    kind = rng.random()
    if kind >= config.step_share + config.turned_share:
        return pairs
    wanted = is_step if kind < config.step_share else is_turned
    return sorted(pairs, key=lambda pair: not wanted(similarity_between(scene, *pair)))


def similarity_between(scene: SceneFeatures, a: int, b: int) -> complex:
    """Scale and turn from view a to view b, as a complex number; NaN where b shows too little."""
    seen = np.isfinite(scene.seen_at[a, b, :, 0])
    if seen.sum() < _LEAST_SEEN:
        return complex("nan")
    before, after = (points[seen] @ (1, 1j) for points in (scene.points[a], scene.seen_at[a, b]))
    before, after = before - before.mean(), after - after.mean()
    return (before.conj() @ after) / max((before.conj() @ before).real, 1e-9)


def is_step(similarity: complex) -> bool:
    """Whether two frames of a video may differ so."""
    return (abs(np.angle(similarity)) < _STEP_TURN_RAD
            and 1 / _STEP_SCALE < abs(similarity) < _STEP_SCALE)


def is_turned(similarity: complex) -> bool:
    """Whether one of the views looks the other way round, or nearly."""
    return abs(np.angle(similarity)) > _FAR_TURN_RAD


def make_sample(scene: SceneFeatures, a: int, b: int, config: MatchConfig,
                rng: np.random.Generator, count: int) -> MatchSample:
    """Views a and b, of each the `count` best key points, or sometimes a random choice of them."""
    total = scene.points.shape[1]
    count = min(count, total)
    if rng.random() < config.random_share:
        chosen = [rng.permutation(total)[:count] for _ in range(2)]
    else:
        chosen = [np.arange(count)] * 2
    points = [scene.points[view, rows] for view, rows in zip((a, b), chosen, strict=True)]
    match = true_matches(*points, scene.seen_at[a, b, chosen[0]], scene.seen_at[b, a, chosen[1]],
                         config)
    shown = [normalise(p, scene.size) for p in points]
    turns = [rng.integers(4) if rng.random() < config.upside_share else 0 for _ in shown]
    return MatchSample(
        np.stack([turned(p, turn) for p, turn in zip(shown, turns, strict=True)]),
        np.stack([scene.scores[view, rows] for view, rows in zip((a, b), chosen, strict=True)]),
        np.stack([scene.descriptors[view, rows]
                  for view, rows in zip((a, b), chosen, strict=True)]),
        np.stack(match))


def turned(positions: np.ndarray, quarters: int) -> np.ndarray:
    """Positions (..., 2) about the centre, turned by as many right angles."""
    x, y = np.moveaxis(positions, -1, 0)
    return np.stack(((x, y), (-y, x), (-x, -y), (y, -x))[quarters], axis=-1)
