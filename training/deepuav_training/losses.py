"""Losses of the SuperPoint networks."""

import torch
import torch.nn.functional as F

from deepuav_training.keypoints import CELL

_MASKED = -1e4


def detector_loss(logits: torch.Tensor, cells: torch.Tensor, known: torch.Tensor) -> torch.Tensor:
    """Cross-entropy against soft labels, the mean over the known cells.

    Args:
        logits: (B, 65, h, w).
        cells: (B, 65, h, w) probabilities.
        known: (B, h, w) bool.
    """
    entropy = -(cells * F.log_softmax(logits, dim=1)).sum(dim=1)
    return (entropy * known).sum() / known.sum().clamp(min=1)


def position_loss(logits: torch.Tensor, points: torch.Tensor, nearest: torch.Tensor,
                  valid: torch.Tensor, sigma: float, reach: int) -> torch.Tensor:
    """Cross-entropy of where a key point is, given that it is near: also across cells' borders.

    Unlike detector_loss it weighs uncertain key points as much as certain ones. Pixels nearer to
    another key point take no part: a maximum there is that one's.

    Args:
        logits: (B, 65, h, w).
        points: (B, K, 2) in pixels, valid ones at least `reach` + 1 from the edge.
        nearest: (B, H, W) number of the key point that is nearest to a pixel.
        valid: (B, K) bool.
        sigma: of the Gaussian around the true position, pixels.
        reach: pixels from the point to the edge of the window that is looked at.
    """
    probability = F.pixel_shuffle(F.log_softmax(logits, dim=1)[:, :-1], CELL)[:, 0]
    width = probability.shape[2]
    pixels = points.round().long()
    steps = torch.arange(-reach, reach + 1, device=points.device)
    rows, columns = pixels[..., 1, None] + steps, pixels[..., 0, None] + steps
    index = (rows[..., :, None] * width + columns[..., None, :]).flatten(2)
    index = torch.where(valid[..., None], index, 0)
    window, owner = (values.flatten(1).gather(1, index.flatten(1)).view_as(index)
                     for values in (probability, nearest))
    anothers = owner != owner[..., index.shape[2] // 2, None]
    x, y = ((-0.5 * ((at - point[..., None]) / sigma) ** 2)
            for at, point in ((columns, points[..., 0]), (rows, points[..., 1])))
    near = (y[..., :, None] + x[..., None, :]).flatten(2)
    target = F.softmax(near.masked_fill(anothers, _MASKED), dim=2)
    entropy = -(target * F.log_softmax(window.masked_fill(anothers, _MASKED), dim=2)).sum(dim=2)
    return (entropy * valid).sum() / valid.sum().clamp(min=1)


def sample_descriptors(descriptors: torch.Tensor, points: torch.Tensor, height: int, width: int
                       ) -> torch.Tensor:
    """Bicubic unit descriptors (B, K, C) of the map (B, C, h, w) at points (B, K, 2) in pixels."""
    size = points.new_tensor([width, height])
    grid = (points + 0.5) / size * 2 - 1
    sampled = F.grid_sample(descriptors, grid[:, None], mode="bicubic", padding_mode="border",
                            align_corners=False)
    return F.normalize(sampled[:, :, 0].transpose(1, 2), dim=2)


def distillation_loss(descriptors: torch.Tensor, teacher: torch.Tensor, valid: torch.Tensor
                      ) -> torch.Tensor:
    """Mean of 1 - cosine to the teacher's descriptors.

    Args:
        descriptors, teacher: (B, K, C), of length 1.
        valid: (B, K) bool.
    """
    distance = 1 - (descriptors * teacher).sum(dim=2)
    return (distance * valid).sum() / valid.sum().clamp(min=1)


def dual_softmax_loss(a: torch.Tensor, b: torch.Tensor, points_a: torch.Tensor,
                      points_b: torch.Tensor, valid: torch.Tensor, temperature: float,
                      exclusion_px: float) -> torch.Tensor:
    """Negative log-likelihood of the true match, among all points of b and among all of a.

    Points that lie nearer than `exclusion_px` to the true match are no counter-examples: their
    descriptors share most of their support.

    Args:
        a, b: (B, K, C) descriptors of length 1; row k of a corresponds to row k of b.
        points_a, points_b: (B, K, 2) in pixels.
        valid: (B, K) bool.
    """
    similarity = a @ b.transpose(1, 2) / temperature
    other = ~torch.eye(a.shape[1], dtype=torch.bool, device=a.device)
    near_a = (torch.cdist(points_a, points_a) < exclusion_px) & other
    near_b = (torch.cdist(points_b, points_b) < exclusion_px) & other
    absent = ~(valid[:, :, None] & valid[:, None, :])
    rows = similarity.masked_fill(near_b | absent, _MASKED)
    columns = similarity.masked_fill(near_a | absent, _MASKED)
    likelihood = (torch.diagonal(F.log_softmax(rows, dim=2), dim1=1, dim2=2)
                  + torch.diagonal(F.log_softmax(columns, dim=1), dim1=1, dim2=2))
    return -0.5 * (likelihood * valid).sum() / valid.sum().clamp(min=1)
