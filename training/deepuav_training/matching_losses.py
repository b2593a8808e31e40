"""Losses of the SuperGlue network."""

import torch
import torch.nn.functional as F

from deepuav_training.data.matches import UNMATCHED


def assignment_loss(log_assignment: torch.Tensor, match0: torch.Tensor) -> torch.Tensor:
    """Negative log-likelihood of the true matches, the mean over all.

    Args:
        log_assignment: (B, N, M).
        match0: (B, N) index in the other view, or less than 0.
    """
    matched = match0 >= 0
    found = log_assignment.gather(2, match0.clamp(min=0)[:, :, None])[:, :, 0]
    return -(found * matched).sum() / matched.sum().clamp(min=1)


def unmatched_loss(matchability0: torch.Tensor, matchability1: torch.Tensor,
                   match0: torch.Tensor, match1: torch.Tensor) -> torch.Tensor:
    """Negative log-likelihood that key points without a match have none, the mean over both views.

    Args:
        matchability0, matchability1: (B, N) and (B, M) logits.
        match0, match1: (B, N) and (B, M) indices, UNMATCHED or UNKNOWN.
    """
    means = []
    for logits, match in ((matchability0, match0), (matchability1, match1)):
        unmatched = match == UNMATCHED
        means.append((F.softplus(logits) * unmatched).sum() / unmatched.sum().clamp(min=1))
    return 0.5 * (means[0] + means[1])
