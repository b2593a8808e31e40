"""Losses of the SuperGlue network."""

import torch
import torch.nn.functional as F

from deepuav_training.data.matches import MISTAKABLE, UNMATCHED


def assignment_loss(log_assignment: torch.Tensor, match0: torch.Tensor) -> torch.Tensor:
    """Negative log-likelihood of the true matches: of a pair their mean, then of pairs.

    A pair of few matches, which is a hard one, counts as much as one of many.

    Args:
        log_assignment: (B, N, M).
        match0: (B, N) index in the other view, or less than 0.
    """
    found = log_assignment.gather(2, match0.clamp(min=0)[:, :, None])[:, :, 0]
    return -mean_of_means(found, match0 >= 0)


def mean_of_means(values: torch.Tensor, weights: torch.Tensor) -> torch.Tensor:
    """The mean over the rows that have any weight of the weighted mean of a row's values (B, N)."""
    sums = weights.sum(dim=1)
    means = (values * weights).sum(dim=1) / sums.clamp(min=torch.finfo(values.dtype).tiny)
    return means.sum() / (sums > 0).sum().clamp(min=1)


def unmatched_loss(matchability0: torch.Tensor, matchability1: torch.Tensor,
                   match0: torch.Tensor, match1: torch.Tensor, mistakable: float = 1.0
                   ) -> torch.Tensor:
    """Negative log-likelihood that key points without a match have none, the mean over both views.

    Args:
        matchability0, matchability1: (B, N) and (B, M) logits.
        match0, match1: (B, N) and (B, M) indices, UNMATCHED, UNKNOWN or MISTAKABLE.
        mistakable: weight of a mistakable key point, where an unmatched one has 1.
    """
    means = [mean_of_means(F.softplus(logits), (match == UNMATCHED)
                           + mistakable * (match == MISTAKABLE))
             for logits, match in ((matchability0, match0), (matchability1, match1))]
    return 0.5 * (means[0] + means[1])
