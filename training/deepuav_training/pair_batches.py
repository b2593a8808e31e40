"""Batches of pairs for the matcher, drawn in other processes while the network learns."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch
from torch.utils.data import DataLoader, Dataset

from deepuav_training.data.matches import MatchSample, MatchSource

_AHEAD = 3  # batches that each process draws in advance
Views = tuple[torch.Tensor, torch.Tensor]  # of the first and of the second views


@dataclass(frozen=True)
class GlueBatch:
    """B pairs as tensors."""

    keypoints: Views  # (B, K, 2)
    scores: Views  # (B, K)
    descriptors: Views  # (B, K, C) of any length
    match: Views  # (B, K)

    def to(self, device: str) -> "GlueBatch":
        """The same on a device."""
        return GlueBatch(*(tuple(t.to(device, non_blocking=True) for t in views)
                           for views in vars(self).values()))

    def pin_memory(self) -> "GlueBatch":
        """The same where a GPU can fetch it from; DataLoader calls this."""
        return GlueBatch(*(tuple(t.pin_memory() for t in views) for views in vars(self).values()))


def collate(samples: list[MatchSample]) -> GlueBatch:
    """Stacks samples into a batch."""
    return GlueBatch(*(
        tuple(torch.from_numpy(np.stack([getattr(sample, name)[side] for sample in samples]))
              for side in (0, 1))
        for name in ("keypoints", "scores", "descriptors", "match")))


class _Steps(Dataset):
    """The batch of each step."""

    def __init__(self, source: MatchSource, batch: int):
        self._source, self._batch = source, batch

    def __getitem__(self, step: int) -> GlueBatch:
        points = self._source.points_of_batch(step)
        first = step * self._batch
        return collate([self._source.draw(first + k, points) for k in range(self._batch)])


class PairBatches:
    """The batch of each step, the same whoever draws it."""

    def __init__(self, source: MatchSource, batch: int, workers: int = 0, device: str = "cpu"):
        """`batch` pairs, drawn by so many processes, or by this one if there are none."""
        self._steps, self._workers, self._device = _Steps(source, batch), workers, device
        self._next, self._batches = -1, iter(())

    def at(self, step: int) -> GlueBatch:
        """On the device; steps that follow each other are drawn in advance."""
        if step != self._next:
            self._batches = self._from(step)
        self._next = step + 1
        return next(self._batches).to(self._device)

    def _from(self, step: int) -> Iterator[GlueBatch]:
        return iter(DataLoader(
            self._steps, batch_size=None, sampler=itertools.count(step), num_workers=self._workers,
            prefetch_factor=_AHEAD if self._workers else None, pin_memory=self._device != "cpu",
            # A fork of this process has its locks, but not the threads that hold them: it can hang.
            multiprocessing_context="forkserver" if self._workers else None))
