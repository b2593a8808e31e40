"""Stage 4: SuperGlue learns, from the features of cached scenes, what matches and what does not.

    python -m deepuav_training.train_superglue --config configs/superglue.yaml

Stopped at any time (SIGINT and SIGTERM write a checkpoint), the same command goes on.
"""

import logging
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch

from deepuav_training.cache_identity import check_claim
from deepuav_training.cache_scenes import CacheConfig, scene_identity
from deepuav_training.checkpoint import TrainingState
from deepuav_training.config import check_field, load_config
from deepuav_training.data.matches import MatchConfig, MatchSample, MatchSource
from deepuav_training.errors import telling_errors
from deepuav_training.matching_losses import assignment_loss, unmatched_loss
from deepuav_training.models.superglue import SuperGlue, SuperGlueConfig
from deepuav_training.scene_cache import cached_scenes
from deepuav_training.training_run import (Objective, RunConfig, finish_run, in_16_bits,
                                           run_arguments, start_run, training_state)

_LOG = logging.getLogger(__name__)
_PROJECTION_PAIRS = 200  # whose descriptors give the principal axes


@dataclass(frozen=True)
class GlueLossConfig:
    """Weights of the losses' sum. Earlier layers learn too, so that each one helps by itself."""

    assignment: float = 1.0
    unmatched: float = 1.0
    earlier: float = 0.2  # mean over the layers before the last of the same two losses
    mistakable: float = 1.0  # of a mistakable key point; of another unmatched one 1

    def check(self, where: str) -> None:
        for name, value in vars(self).items():
            check_field(value >= 0, where, name, value, "at least 0")


@dataclass(frozen=True)
class GlueTrainConfig(RunConfig):
    """A training run of SuperGlue."""

    scenes: tuple = ("configs/scenes.yaml",)  # configurations that scenes were cached with
    run: str = "runs/superglue"
    network: SuperGlueConfig = field(default_factory=SuperGlueConfig)
    matches: MatchConfig = field(default_factory=MatchConfig)
    losses: GlueLossConfig = field(default_factory=GlueLossConfig)


@dataclass(frozen=True)
class GlueBatch:
    """B pairs as tensors; each pair of tensors is one of the first and one of the second views."""

    keypoints: tuple[torch.Tensor, torch.Tensor]  # (B, K, 2)
    scores: tuple[torch.Tensor, torch.Tensor]  # (B, K)
    descriptors: tuple[torch.Tensor, torch.Tensor]  # (B, K, C)
    match: tuple[torch.Tensor, torch.Tensor]  # (B, K)


def collate(samples: list[MatchSample]) -> GlueBatch:
    """Stacks samples into a batch."""
    return GlueBatch(*(
        tuple(torch.from_numpy(np.stack([getattr(sample, name)[side] for sample in samples]))
              for side in (0, 1))
        for name in ("keypoints", "scores", "descriptors", "match")))


def losses_of(network: SuperGlue, batch: GlueBatch, config: GlueTrainConfig
              ) -> dict[str, torch.Tensor]:
    """Each loss by name, not yet weighted."""
    inputs = [tensors[side] for side in (0, 1)
              for tensors in (batch.keypoints, batch.scores, batch.descriptors)]
    with in_16_bits(config):
        first, *states = network.states(*inputs)
        assigned = [network.assign(*state) for state in states or [first]]
    pairs = [(assignment_loss(log, batch.match[0]),
              unmatched_loss(z0, z1, *batch.match, config.losses.mistakable))
             for log, z0, z1 in assigned]
    *earlier, (assignment, unmatched) = pairs
    layers = [a + u for a, u in earlier] or [torch.zeros(())]
    return {"assignment": assignment, "unmatched": unmatched,
            "earlier": torch.stack(layers).mean()}


def new_state(config: GlueTrainConfig, source: MatchSource | None) -> TrainingState:
    """An untrained network: the dual-softmax matcher in the space of the source's descriptors."""
    torch.manual_seed(config.seed)
    network = SuperGlue(config.network)
    if source is not None:
        seen = [source.draw(number).descriptors for number in range(_PROJECTION_PAIRS)]
        kept = network.set_projection(torch.from_numpy(np.concatenate(seen).reshape(
            -1, config.network.descriptor)))
        _LOG.info("the projection keeps %.1f %% of the descriptors' energy", 100 * kept)
    return training_state(network, config)


def objective(source: MatchSource, config: GlueTrainConfig) -> Objective:
    """The losses of the source's pairs, each step's being the next ones."""

    def losses(network: torch.nn.Module, step: int) -> dict[str, torch.Tensor]:
        first = step * config.batch
        batch = collate([source.draw(first + k) for k in range(config.batch)])
        return losses_of(network, batch, config)

    weights = {name: getattr(config.losses, name)
               for name in ("assignment", "unmatched", "earlier")}
    return Objective(losses, weights)


@telling_errors
def main() -> None:
    arguments = run_arguments(__doc__.splitlines()[0]).parse_args()
    config = load_config(GlueTrainConfig, arguments.config)
    start_run(config, arguments)
    caches = [load_config(CacheConfig, file) for file in config.scenes]
    for cache in caches:
        check_claim(cache.cache, scene_identity(cache))
    scenes = [path for cache in caches
              for path in cached_scenes(cache.cache, cache.count, "cache_scenes")]
    source = MatchSource(scenes, config.matches, config.seed)
    _LOG.info("%d scenes", len(source))
    new = not (Path(config.run) / "checkpoint.pt").exists() and not arguments.init
    state = new_state(config, source if new else None)
    finish_run(state, objective(source, config), config, arguments)


if __name__ == "__main__":
    main()
