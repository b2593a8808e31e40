"""Stages 2 and 3: a SuperPoint learns the teacher's labels and to match what corresponds.

    python -m deepuav_training.train_superpoint --config configs/superpoint_small.yaml

Stopped at any time (SIGINT and SIGTERM write a checkpoint), the same command goes on.
"""

import functools
import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch

from deepuav_training.cache_identity import check_claim
from deepuav_training.checkpoint import TrainingState, start_from
from deepuav_training.config import check_field, load_config
from deepuav_training.data.pairs import PairConfig, PairSource, Sample
from deepuav_training.data.scene_pairs import ScenePairConfig, ScenePairSource, mixed_draw
from deepuav_training.errors import telling_errors
from deepuav_training.label import LabelConfig, label_identity, training_views
from deepuav_training.label_scenes import LabelScenesConfig, labelled_identity
from deepuav_training.losses import (detector_loss, distillation_loss, dual_softmax_loss,
                                     position_loss, sample_descriptors)
from deepuav_training.models.superpoint_large import LargeSuperPoint
from deepuav_training.models.superpoint_small import SmallSuperPoint, SmallSuperPointConfig
from deepuav_training.onnx_weights import load_exported
from deepuav_training.scene_cache import cached_scenes
from deepuav_training.training_run import (Objective, RunConfig, finish_run, in_16_bits,
                                           run_arguments, start_run, training_state)

_LOG = logging.getLogger(__name__)
Draw = Callable[[int], Sample]  # the sample of a running number

_STATISTICS_PAIRS = 32  # from which an exported network's normalisations are restored


@dataclass(frozen=True)
class LossConfig:
    """Weights of the losses' sum."""

    detector: float = 1.0
    position: float = 0.0
    distillation: float = 2.0
    matching: float = 0.3
    position_sigma: float = 0.6  # pixels
    position_reach: int = 3  # pixels
    temperature: float = 0.07
    exclusion_px: float = 10.0  # nearer points are no counter-examples

    def check(self, where: str) -> None:
        check_field(self.temperature > 0, where, "temperature", self.temperature, "positive")
        check_field(self.position_sigma > 0, where, "position_sigma", self.position_sigma,
                    "positive")
        check_field(1 <= self.position_reach <= 5, where, "position_reach", self.position_reach,
                    "1 to 5: less than pairs.label_border")


@dataclass(frozen=True)
class TrainConfig(RunConfig):
    """A training run of a SuperPoint, small or large."""

    labels: str = "configs/labels.yaml"  # the configuration that the labels were made with
    run: str = "runs/superpoint_small"
    size: str = "small"
    frozen: tuple = ()  # beginnings of the names of parameters that stay as they are
    network: SmallSuperPointConfig = field(default_factory=SmallSuperPointConfig)  # of the small
    pairs: PairConfig = field(default_factory=PairConfig)
    rendered: ScenePairConfig = field(default_factory=ScenePairConfig)
    losses: LossConfig = field(default_factory=LossConfig)

    def check(self, where: str) -> None:
        super().check(where)
        check_field(self.size in ("small", "large"), where, "size", self.size, "small or large")
        names = [name for name, _ in new_network(self).named_parameters()]
        for option, starts in (("frozen", self.frozen), ("added", self.added)):
            for start in starts:
                check_field(any(name.startswith(start) for name in names), where, option, start,
                            "the beginning of a parameter's name")


@dataclass(frozen=True)
class Batch:
    """B pairs as tensors: first the B labelled views, then their B warped copies."""

    images: torch.Tensor  # (2B, 1, H, W) in 0..1
    cells: torch.Tensor  # (2B, 65, h, w)
    known: torch.Tensor  # (2B, h, w) bool
    nearest: torch.Tensor  # (2B, H, W) numbers of labelled points
    points: torch.Tensor  # (2B, K, 2)
    descriptors: torch.Tensor  # (B, K, C)
    valid: torch.Tensor  # (B, K) bool

    def to(self, device: str) -> "Batch":
        """The same on a device."""
        return Batch(*(tensor.to(device) for tensor in vars(self).values()))


def collate(samples: list[Sample]) -> Batch:
    """Stacks samples into a batch."""

    def views_first(name: str) -> torch.Tensor:
        stacked = np.stack([getattr(sample, name) for sample in samples], axis=1)
        return torch.from_numpy(stacked.reshape(-1, *stacked.shape[2:]))

    descriptors = torch.from_numpy(np.stack([sample.descriptors for sample in samples]))
    counts = torch.tensor([sample.count for sample in samples])
    valid = torch.arange(descriptors.shape[1])[None] < counts[:, None]
    return Batch(views_first("images")[:, None].float() / 255, views_first("cells"),
                 views_first("known"), views_first("nearest"), views_first("points"),
                 descriptors, valid)


def losses_of(network: torch.nn.Module, batch: Batch, config: TrainConfig
              ) -> dict[str, torch.Tensor]:
    """Each loss by name, not yet weighted."""
    with in_16_bits(config):
        images = batch.images.to(memory_format=torch.channels_last)
        logits, descriptors = network(images)
    height, width = batch.images.shape[-2:]
    a, b = sample_descriptors(descriptors.float(), batch.points, height, width).chunk(2)
    points_a, points_b = batch.points.chunk(2)
    twice = torch.cat([batch.valid, batch.valid])
    teacher = torch.cat([batch.descriptors, batch.descriptors])
    c = config.losses
    return {
        "detector": detector_loss(logits.float(), batch.cells, batch.known),
        "position": position_loss(logits.float(), batch.points, batch.nearest, twice,
                                  c.position_sigma, c.position_reach),
        "distillation": distillation_loss(torch.cat([a, b]), teacher, twice),
        "matching": dual_softmax_loss(a, b, points_a, points_b, batch.valid, c.temperature,
                                      c.exclusion_px),
    }


def new_network(config: TrainConfig) -> torch.nn.Module:
    """An untrained network of the size that is asked for."""
    return LargeSuperPoint() if config.size == "large" else SmallSuperPoint(config.network)


def new_state(config: TrainConfig) -> TrainingState:
    """An untrained network with its optimiser."""
    torch.manual_seed(config.seed)
    network = new_network(config)
    for name, parameter in network.named_parameters():
        parameter.requires_grad_(not name.startswith(tuple(config.frozen)))
    return training_state(network.to(memory_format=torch.channels_last), config)


def objective(draw: Draw, config: TrainConfig) -> Objective:
    """The losses of the samples drawn, each step's being the next ones."""

    def losses(network: torch.nn.Module, step: int) -> dict[str, torch.Tensor]:
        first = step * config.batch
        batch = collate([draw(first + k) for k in range(config.batch)]).to(config.device)
        return losses_of(network, batch, config)

    weights = {name: getattr(config.losses, name)
               for name in ("detector", "position", "distillation", "matching")}
    return Objective(losses, weights)


def start(path: Path, state: TrainingState, added: tuple, draw: Draw) -> None:
    """Starts from a checkpoint or, where no checkpoint was kept, from an exported file."""
    if path.suffix != ".onnx":
        start_from(path, state, added)
        return
    device = next(state.network.parameters()).device
    images = collate([draw(k) for k in range(_STATISTICS_PAIRS)]).images.to(device)
    load_exported(path, state.network, images, added)
    state.average.load_state_dict(state.network.state_dict())


def samples(config: TrainConfig) -> Draw:
    """What the run is trained on: warped photographs and, if asked for, rendered scenes."""
    labels = load_config(LabelConfig, config.labels)
    check_claim(labels.cache, label_identity(labels))
    views = training_views(labels)
    flat = PairSource(views, labels.images, labels.cache, labels.views, config.pairs, config.seed)
    _LOG.info("%d of %d views labelled", len(flat), len(views))
    c = config.rendered
    if not c.scenes:
        return flat.draw
    rendered = load_config(LabelScenesConfig, c.scenes)
    check_claim(rendered.cache, labelled_identity(rendered))
    size = (rendered.scene.width, rendered.scene.height)
    check_field(size == (labels.views.width, labels.views.height), c.scenes, "scene's size", size,
                f"the size of the views of {config.labels}")
    paths = cached_scenes(rendered.cache, rendered.count, "label_scenes")
    scenes = ScenePairSource(paths, c.least_shared, config.pairs, config.seed)
    _LOG.info("%d of %d scenes labelled", len(scenes), rendered.count)
    return mixed_draw(flat, scenes, c.share)


@telling_errors
def main() -> None:
    arguments = run_arguments(__doc__.splitlines()[0]).parse_args()
    config = load_config(TrainConfig, arguments.config)
    start_run(config, arguments)
    draw = samples(config)
    finish_run(new_state(config), objective(draw, config), config, arguments,
               functools.partial(start, draw=draw))


if __name__ == "__main__":
    main()
