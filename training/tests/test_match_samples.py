import gc
import os
from functools import partial

import numpy as np
import pytest
import torch
from superglue_support import CONFIG, TINY, tiny_scene

from deepuav_training.data.matches import (MISTAKABLE, UNKNOWN, UNMATCHED, MatchConfig,
                                           MatchSource, make_sample, normalise, preferred_pairs,
                                           similarity_between, true_matches, turned)
from deepuav_training.errors import TrainingError
from deepuav_training.pair_batches import PairBatches
from deepuav_training.scene_cache import SceneFeatures, cached_scenes, save_scene, scene_path

NAN = [np.nan, np.nan]


def test_true_matches_are_mutual_and_near():
    points0 = np.array([[10.0, 10], [30, 10], [50, 10], [70, 10]])
    points1 = np.array([[11.0, 10], [34, 10], [90, 90]])
    match0, match1 = true_matches(points0, points1, points0, points1, MatchConfig())
    assert match0.tolist() == [0, UNKNOWN, UNMATCHED, UNMATCHED]
    assert match1.tolist() == [0, UNKNOWN, UNMATCHED]


def test_unmatched_points_with_another_near_are_mistakable():
    points0 = np.array([[10.0, 10], [34, 10], [50, 10], [70, 10]])
    points1 = np.array([[11.0, 10], [30, 10], [56, 10], [90, 10]])
    config = MatchConfig(apart_px=5, mistakable_px=10)
    match0, match1 = true_matches(points0, points1, points0, points1, config)
    assert match0.tolist() == [0, UNKNOWN, MISTAKABLE, UNMATCHED]
    assert match1.tolist() == [0, UNKNOWN, MISTAKABLE, UNMATCHED]


def test_of_two_candidates_the_nearer_matches():
    points0, points1 = np.array([[10.0, 10], [12, 10]]), np.array([[10.5, 10]])
    match0, match1 = true_matches(points0, points1, points0, points1, MatchConfig())
    assert match0.tolist() == [0, UNKNOWN] and match1.tolist() == [0]


def test_points_that_the_other_view_does_not_show_have_no_match():
    points = np.array([[10.0, 10], [30, 10]])
    seen = np.array([NAN, [30, 10]])
    match0, match1 = true_matches(points, points, seen, points, MatchConfig())
    assert match0.tolist() == [UNMATCHED, 1] and match1.tolist() == [UNKNOWN, 1]


def test_positions_are_normalised_by_the_longer_side():
    points = normalise(np.array([[0.0, 0], [480, 360], [240, 180]]), np.array([480, 360]))
    np.testing.assert_allclose(points, [[-1, -0.75], [1, 0.75], [0, 0]])


def test_samples_repeat_and_keep_their_rows_together(source):
    assert len(source) == 3
    first, again = source.draw(7), source.draw(7)
    np.testing.assert_array_equal(first.descriptors, again.descriptors)
    assert first.keypoints.shape == (2, 12, 2) and first.descriptors.shape == (2, 12, 32)
    rows = np.flatnonzero(first.match[0] >= 0)
    assert len(rows) >= 4
    np.testing.assert_array_equal(first.match[1][first.match[0][rows]], rows)
    assert not np.array_equal(first.keypoints, source.draw(8).keypoints)


def test_batches_are_the_same_whoever_draws_them(source):
    own, others = PairBatches(source, 2), PairBatches(source, 2, workers=2)
    for step in (0, 1, 2, 7, 8):  # one after another, and after a jump
        for a, b in zip(vars(own.at(step)).values(), vars(others.at(step)).values(), strict=True):
            assert all(torch.equal(x, y) for x, y in zip(a, b, strict=True))
    assert torch.equal(own.at(1).keypoints[0][0], torch.from_numpy(source.draw(2).keypoints[0]))


class LeftInACycle:
    """Only the garbage collector frees it; that ends any process but the one that made it."""

    def __init__(self):
        self.itself, self.maker = self, os.getpid()

    def __del__(self):
        if os.getpid() != self.maker:
            os._exit(1)


class CollectingSource(MatchSource):
    """Collects garbage wherever it draws."""

    def draw(self, number, points=None):
        gc.collect()
        return super().draw(number, points)


def test_those_who_draw_inherit_nothing_of_the_run(source, tmp_path):
    LeftInACycle()
    scenes = partial(cached_scenes, tmp_path / "scenes", 5, "cache_scenes")
    batches = PairBatches(CollectingSource(scenes, CONFIG.matches, 1), 2, workers=1)
    assert batches.at(0).scores[0].shape == (2, 12)


def test_some_batches_have_more_points(tmp_path):
    save_scene(scene_path(tmp_path, 0), tiny_scene(0))
    config = MatchConfig(points=6, more_points=14, more_share=0.5, least_matches=1)
    batches = PairBatches(MatchSource(lambda: cached_scenes(tmp_path, 1, ""), config, seed=1), 2)
    counts = [batches.at(step).scores[0].shape[1] for step in range(20)]
    assert set(counts) == {6, 14}
    assert counts == [batches.at(step).scores[0].shape[1] for step in range(20)]


@pytest.mark.parametrize("relist_s,expected", [(np.inf, 1), (-1.0, 2)])
def test_scenes_made_meanwhile_are_taken_in_if_asked_for(tmp_path, relist_s, expected):
    save_scene(scene_path(tmp_path, 0), tiny_scene(0))
    source = MatchSource(lambda: cached_scenes(tmp_path, 2, ""), CONFIG.matches, 1, relist_s)
    save_scene(scene_path(tmp_path, 1), tiny_scene(1))
    source.draw(0)
    assert len(source) == expected


def scene_of_turns(angles_deg, scales):
    """Views of the same points, turned and scaled about the middle."""
    rng = np.random.default_rng(4)
    middle = rng.uniform(-20, 20, 40) + 1j * rng.uniform(-20, 20, 40)
    seen = [50 + 50j + middle * scale * np.exp(1j * np.radians(angle))
            for angle, scale in zip(angles_deg, scales, strict=True)]
    points = np.stack([np.stack([z.real, z.imag], axis=1) for z in seen]).astype(np.float32)
    count = len(seen)
    descriptors = np.tile(np.eye(40, TINY.descriptor, dtype=np.float32), (count, 1, 1))
    return SceneFeatures(points, np.ones((count, 40), np.float32), descriptors,
                         np.tile(points[None], (count, 1, 1, 1)), np.array([100, 100], np.int32))


def test_similarity_between_views_is_that_of_what_both_see():
    scene = scene_of_turns([0, 100], [1, 1.5])
    assert similarity_between(scene, 0, 1) == pytest.approx(1.5 * np.exp(1j * np.radians(100)))
    scene.seen_at[0, 1, 10:] = np.nan
    assert np.isnan(similarity_between(scene, 0, 1))


@pytest.mark.parametrize("step,turned_far,expected", [(1.0, 0.0, {(0, 1), (1, 0)}),
                                                      (0.0, 1.0, {(0, 2), (1, 2), (2, 0), (2, 1)})])
def test_pairs_of_the_kind_that_is_drawn_come_first(step, turned_far, expected):
    scene = scene_of_turns([0, 10, 170], [1, 1.2, 1])
    config = MatchConfig(step_share=step, turned_share=turned_far)
    rng = np.random.default_rng(2)
    first = {preferred_pairs(scene, config, rng)[0] for _ in range(40)}
    assert first == expected


def test_the_best_key_points_are_taken_unless_a_choice_is_drawn():
    scene, rng = tiny_scene(1), np.random.default_rng(3)
    best = make_sample(scene, 0, 1, MatchConfig(random_share=0), rng, 6)
    np.testing.assert_array_equal(best.scores, scene.scores[:2, :6])
    other = make_sample(scene, 0, 1, MatchConfig(random_share=1), rng, 6)
    assert not np.array_equal(other.scores, best.scores)


def test_positions_turn_by_right_angles_about_the_centre():
    points = np.array([[0.5, 0.25]])
    np.testing.assert_array_equal([turned(points, k)[0] for k in range(4)],
                                  [[0.5, 0.25], [-0.25, 0.5], [-0.5, -0.25], [0.25, -0.5]])


def test_a_cache_without_scenes_is_refused(tmp_path):
    with pytest.raises(TrainingError, match="no scenes"):
        cached_scenes(tmp_path, 4, "cache_scenes")
