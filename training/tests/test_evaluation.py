import numpy as np
import pytest

from deepuav_training.data.homography import (HomographyConfig, inside, sample_homography,
                                              translation_matrix, warp_points)
from deepuav_training.evaluate import SETS, make_pair
from deepuav_training.metrics import (area_under_curve, homography_error, mutual_nearest,
                                      precision, repeatability)


def test_area_under_curve():
    assert area_under_curve([0.0, 0.0], 1) == 1
    assert area_under_curve([5.0, np.inf], 1) == 0
    assert area_under_curve([0.5], 1) == pytest.approx(0.75)
    assert area_under_curve([0.5, np.inf], 1) == pytest.approx(0.375)


def test_only_mutual_neighbours_match():
    a = np.array([[1.0, 0.0], [0.0, 1.0], [0.6, 0.8]])
    b = np.array([[0.0, 1.0], [1.0, 0.0]])
    assert mutual_nearest(a, b).tolist() == [[0, 1], [1, 0]]
    assert mutual_nearest(a, b[:0]).shape == (0, 2)


def test_precision_counts_matches_within_the_limit():
    a = np.array([[10.0, 10.0], [20.0, 20.0], [30.0, 10.0], [40.0, 40.0]])
    b = a + (5, 0)
    b[3] += (0, 4)
    assert precision(a, b, translation_matrix((5, 0)), 3.0) == 0.75
    assert precision(a[:0], b[:0], np.eye(3), 3.0) == 0


def test_repeatability_counts_the_common_area_only():
    a = np.array([[10.0, 10.0], [90.0, 50.0], [50.0, 50.0]])
    b = np.array([[30.0, 10.0], [70.0, 80.0]])  # 90 + 20 lies outside b
    assert repeatability(a, b, translation_matrix((20, 0)), (100, 100), (100, 100), 3.0) == 0.5


def test_homography_is_found_among_outliers_and_noise():
    rng = np.random.default_rng(0)
    for seed in range(5):
        truth = sample_homography(np.random.default_rng(seed),
                                  HomographyConfig(any_rotation_share=1), 640, 480)
        a = rng.uniform(0, 1, (400, 2)) * (640, 480)
        b = warp_points(truth, a)
        seen = np.flatnonzero(inside(b, 640, 480))
        a, b = a[seen], b[seen] + rng.normal(0, 0.3, (len(seen), 2))
        wrong = rng.random(len(a)) < 0.3
        b[wrong] = rng.uniform(0, 1, (wrong.sum(), 2)) * (640, 480)
        assert homography_error(a, b, truth, 640, 480) < 2.0


def test_too_few_matches_give_no_homography():
    assert homography_error(np.zeros((3, 2)), np.zeros((3, 2)), np.eye(3), 640, 480) == np.inf


@pytest.mark.parametrize("kind", SETS)
def test_pairs_show_the_same_ground(kind):
    rng = np.random.default_rng(0)
    photo = np.zeros((90, 130), np.uint8)
    photo[38:48, 60:70] = 255  # a square about (64.5, 42.5)
    pair = make_pair(photo, kind, rng)
    assert pair.a.shape == pair.b.shape == (88, 128)
    x, y = warp_points(pair.b_from_a, np.array([[64.5, 42.5]]))[0]
    assert pair.b[int(round(y)), int(round(x))] > np.median(pair.b) + 30
