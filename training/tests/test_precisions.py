"""What another precision changes of key points and descriptors."""

import numpy as np
import pytest

from deepuav_training.compare_precisions import Change, change, mean_change
from deepuav_training.keypoints import unit_descriptors
from deepuav_training.runtime import Features


def features(points: list, descriptors: list) -> Features:
    return Features(np.array(points, np.float32).reshape(-1, 2), np.ones(len(points), np.float32),
                    unit_descriptors(np.array(descriptors, np.float32).reshape(-1, 2)), (64, 48))


REFERENCE = features([[10, 10], [30, 10], [50, 40]], [[1, 0], [0, 1], [1, 1]])


def test_the_same_changes_nothing():
    same = change(REFERENCE, REFERENCE)
    assert same.found == 1
    assert same.moved_px == 0
    assert same.unlike == pytest.approx(0, abs=1e-6)


def test_tells_what_is_lost_moved_and_turned():
    other = features([[50, 43], [30, 10.4], [10.3, 10]], [[1, 1], [1, 0], [1, 0]])
    changed = change(REFERENCE, other)
    assert changed.found == pytest.approx(2 / 3), "the third moved further than a key point may"
    assert changed.moved_px == pytest.approx(np.sqrt((0.3**2 + 0.4**2) / 2), rel=1e-5)
    assert changed.unlike == pytest.approx(0.5), "one turned by 90 degrees, one not"


@pytest.mark.parametrize("other", [features([], []), features([[20, 30]], [[1, 0]])])
def test_nothing_found_again_tells_no_distance(other):
    changed = change(REFERENCE, other)
    assert changed.found == 0
    assert np.isnan(changed.moved_px)
    assert np.isnan(changed.unlike)


def test_an_image_without_points_moves_no_mean():
    of_nothing = change(features([], []), REFERENCE)
    lost = Change(0.0, np.nan, np.nan)
    assert mean_change([of_nothing, lost, Change(1.0, 0.5, 0.1)]) == Change(0.5, 0.5, 0.1)
