"""Stage 4: SuperGlue learns, from the features of cached scenes, what matches and what does not.

    python -m deepuav_training.train_superglue --config configs/superglue.yaml

Stopped at any time (SIGINT and SIGTERM write a checkpoint), the same command goes on.
"""

import functools
import logging
import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F

from deepuav_training.cache_identity import check_claim
from deepuav_training.cache_scenes import CacheConfig, scene_identity
from deepuav_training.checkpoint import TrainingState
from deepuav_training.config import check_field, load_config
from deepuav_training.data.matches import MatchConfig, MatchSource
from deepuav_training.errors import telling_errors
from deepuav_training.keypoints import unit_descriptors
from deepuav_training.matching_losses import assignment_loss, unmatched_loss
from deepuav_training.models.superglue import SuperGlue, SuperGlueConfig
from deepuav_training.pair_batches import GlueBatch, PairBatches
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
    relist_s: float = 0.0  # seconds after which scenes made meanwhile are taken in; 0: never
    workers: int = 0  # processes that draw pairs; 0: the training's own
    run: str = "runs/superglue"
    network: SuperGlueConfig = field(default_factory=SuperGlueConfig)
    matches: MatchConfig = field(default_factory=MatchConfig)
    losses: GlueLossConfig = field(default_factory=GlueLossConfig)

    def check(self, where: str) -> None:
        super().check(where)
        for name in ("relist_s", "workers"):
            value = getattr(self, name)
            check_field(value >= 0, where, name, value, "at least 0")


def losses_of(network: SuperGlue, batch: GlueBatch, config: GlueTrainConfig
              ) -> dict[str, torch.Tensor]:
    """Each loss by name, not yet weighted."""
    descriptors = [F.normalize(views.float(), dim=2) for views in batch.descriptors]
    inputs = [tensors[side] for side in (0, 1)
              for tensors in (batch.keypoints, batch.scores, descriptors)]
    with in_16_bits(config):
        first, *states = network.states(*inputs)
        assigned = [network.assign(*state) for state in states or [first]]
    pairs = [(assignment_loss(log, batch.match[0]),
              unmatched_loss(z0, z1, *batch.match, config.losses.mistakable))
             for log, z0, z1 in assigned]
    *earlier, (assignment, unmatched) = pairs
    layers = [a + u for a, u in earlier] or [assignment.new_zeros(())]
    return {"assignment": assignment, "unmatched": unmatched,
            "earlier": torch.stack(layers).mean()}


def new_state(config: GlueTrainConfig, source: MatchSource | None) -> TrainingState:
    """An untrained network: the dual-softmax matcher in the space of the source's descriptors."""
    torch.manual_seed(config.seed)
    network = SuperGlue(config.network)
    if source is not None:
        seen = [source.draw(number).descriptors for number in range(_PROJECTION_PAIRS)]
        kept = network.set_projection(torch.from_numpy(unit_descriptors(np.concatenate(
            seen).reshape(-1, config.network.descriptor))))
        _LOG.info("the projection keeps %.1f %% of the descriptors' energy", 100 * kept)
    return training_state(network, config)


def objective(source: MatchSource, config: GlueTrainConfig) -> Objective:
    """The losses of the source's pairs, each step's being the next ones."""
    batches = PairBatches(source, config.batch, config.workers, config.device)

    def losses(network: torch.nn.Module, step: int) -> dict[str, torch.Tensor]:
        return losses_of(network, batches.at(step), config)

    weights = {name: getattr(config.losses, name)
               for name in ("assignment", "unmatched", "earlier")}
    return Objective(losses, weights)


def scenes_of(caches: list[CacheConfig]) -> list[Path]:
    """The files of all caches."""
    return [path for cache in caches
            for path in cached_scenes(cache.cache, cache.count, "cache_scenes")]


@telling_errors
def main() -> None:
    arguments = run_arguments(__doc__.splitlines()[0]).parse_args()
    config = load_config(GlueTrainConfig, arguments.config)
    start_run(config, arguments)
    caches = [load_config(CacheConfig, file) for file in config.scenes]
    for cache in caches:
        check_claim(cache.cache, scene_identity(cache))
    source = MatchSource(functools.partial(scenes_of, caches), config.matches, config.seed,
                         config.relist_s or math.inf)
    _LOG.info("%d scenes", len(source))
    new = not (Path(config.run) / "checkpoint.pt").exists() and not arguments.init
    state = new_state(config, source if new else None)
    finish_run(state, objective(source, config), config, arguments)


if __name__ == "__main__":
    main()
