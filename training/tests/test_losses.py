import math

import numpy as np
import torch
import torch.nn.functional as F

from deepuav_training import keypoints
from deepuav_training.data.pairs import cell_labels, nearest_points
from deepuav_training.losses import (detector_loss, distillation_loss, dual_softmax_loss,
                                     position_loss, sample_descriptors)


def unit_rows(*shape):
    return F.normalize(torch.randn(*shape, generator=torch.Generator().manual_seed(0)), dim=-1)


def grid_points(count, spacing):
    return torch.stack([spacing * torch.arange(count, dtype=torch.float32), torch.zeros(count)],
                       dim=1)[None]


def test_detector_loss_is_the_labels_entropy_at_the_optimum():
    cells = torch.zeros(1, 65, 2, 2)
    cells[:, 3], cells[:, 64] = 0.25, 0.75
    known = torch.ones(1, 2, 2, dtype=torch.bool)
    entropy = -(0.25 * math.log(0.25) + 0.75 * math.log(0.75))
    best = detector_loss(torch.log(cells + 1e-9), cells, known)
    assert abs(best.item() - entropy) < 1e-5
    assert detector_loss(torch.zeros_like(cells), cells, known) > best + 1


def test_detector_loss_ignores_unknown_cells():
    cells = torch.zeros(1, 65, 1, 2)
    cells[:, 64] = 1
    known = torch.tensor([[[True, False]]])
    logits = torch.zeros(1, 65, 1, 2)
    logits[0, 7, 0, 1] = 100
    assert abs(detector_loss(logits, cells, known).item() - math.log(65)) < 1e-5


def test_detector_loss_without_known_cells_is_zero():
    cells = torch.full((1, 65, 1, 1), 1 / 65)
    assert detector_loss(torch.randn(1, 65, 1, 1), cells, torch.zeros(1, 1, 1).bool()) == 0


def logits_with_points_at(points):
    """Those of a detector that is sure of key points (N, 2), blurred by 0.6 pixels."""
    cells = cell_labels(np.asarray(points), np.full(len(points), 0.9), 48, 40, 0.6)
    return torch.log(torch.from_numpy(cells)[None] + 1e-9)


def position_loss_of(logits, points, valid=None):
    """Of key points (N, 2) that all are labelled, in an image of 48x40."""
    nearest = torch.from_numpy(nearest_points(points.numpy(), 48, 40))[None]
    valid = torch.ones(len(points), dtype=torch.bool) if valid is None else valid
    return position_loss(logits, points[None], nearest, valid[None], 0.6, 3)


def test_position_loss_is_least_at_the_true_position():
    points = torch.tensor([[15.7, 16.2], [31.0, 23.4]])  # the first at the corner of four cells
    found = [position_loss_of(logits_with_points_at(points.numpy() + (shift, 0)), points).item()
             for shift in (-1.0, -0.4, 0.0, 0.4, 1.0)]
    assert found[2] == min(found) and found[0] > found[1] + 1 and found[4] > found[3] + 1


def test_position_loss_does_not_ask_how_sure_the_detector_is():
    points = torch.tensor([[20.3, 20.1]])
    logits = logits_with_points_at(points.numpy())
    unsure = logits.clone()
    unsure[:, 64] += 3
    sure, doubtful = (position_loss_of(l, points).item() for l in (logits, unsure))
    assert abs(sure - doubtful) < 1e-4


def test_position_loss_does_not_count_a_neighbour_as_an_error():
    points = torch.tensor([[15.0, 16.0], [18.0, 16.0]])
    alone, both = (logits_with_points_at(p.numpy()) for p in (points[:1], points))
    assert position_loss_of(both, points) < position_loss_of(alone, points[:1]) + 0.05
    assert position_loss_of(both, points[:1]) > position_loss_of(alone, points[:1]) + 0.5


def test_position_loss_leaves_out_invalid_points():
    points = torch.tensor([[20.3, 20.1], [0.0, 0.0]])
    logits = torch.randn(1, 65, 5, 6, generator=torch.Generator().manual_seed(0))
    alone = position_loss_of(logits, points[:1])
    both = position_loss_of(logits, points, torch.tensor([True, False]))
    torch.testing.assert_close(alone, both)


def test_descriptors_are_sampled_as_for_inference():
    descriptors = F.normalize(torch.randn(1, 16, 6, 8), dim=1)
    points = torch.tensor([[[20.3, 17.8], [35.5, 19.5], [3.5, 3.5]]])
    sampled = sample_descriptors(descriptors, points, 48, 64)[0].numpy()
    expected = keypoints.sample_descriptors(descriptors[0].numpy(), points[0].numpy())
    np.testing.assert_allclose(sampled, expected, atol=1e-4)
    np.testing.assert_allclose(sampled[2], descriptors[0, :, 0, 0].numpy(), atol=1e-4)


def test_distillation_loss_counts_valid_rows_only():
    teacher = unit_rows(1, 4, 8)
    student = teacher.clone()
    student[0, 3] *= -1
    valid = torch.tensor([[True, True, True, False]])
    assert distillation_loss(student, teacher, valid).item() < 1e-6
    assert abs(distillation_loss(student, teacher, torch.ones(1, 4).bool()).item() - 0.5) < 1e-6


def test_dual_softmax_loss_prefers_true_correspondences():
    a = unit_rows(1, 12, 64)
    points = grid_points(12, 50)
    valid = torch.ones(1, 12, dtype=torch.bool)
    true = dual_softmax_loss(a, a, points, points, valid, 0.1, 8)
    wrong = dual_softmax_loss(a, a.roll(1, dims=1), points, points, valid, 0.1, 8)
    assert true < 0.1
    assert wrong > true + 3


def test_dual_softmax_loss_of_equal_descriptors_is_the_logarithm_of_the_count():
    a = F.normalize(torch.ones(1, 10, 8), dim=2)
    valid = torch.tensor([[True] * 6 + [False] * 4])
    loss = dual_softmax_loss(a, a, grid_points(10, 50), grid_points(10, 50), valid, 0.1, 8)
    assert abs(loss.item() - math.log(6)) < 1e-5


def test_dual_softmax_loss_does_not_push_neighbours_apart():
    a = F.normalize(torch.ones(1, 2, 8), dim=2)
    valid = torch.ones(1, 2, dtype=torch.bool)
    near, far = grid_points(2, 3), grid_points(2, 30)
    assert dual_softmax_loss(a, a, near, near, valid, 0.1, 8).item() < 1e-5
    assert abs(dual_softmax_loss(a, a, far, far, valid, 0.1, 8).item() - math.log(2)) < 1e-5
