"""Stage 3: the small SuperPoint learns the teacher's labels and to match what corresponds.

    python -m deepuav_training.train_small --config configs/superpoint_small.yaml

Stopped at any time (SIGINT and SIGTERM write a checkpoint), the same command goes on.
"""

import argparse
import copy
import datetime
import logging
import math
import os
import signal
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch

from deepuav_training.checkpoint import (TrainingState, load_checkpoint, save_checkpoint,
                                         update_average)
from deepuav_training.config import check_field, load_config
from deepuav_training.data.pairs import PairConfig, PairSource, Sample
from deepuav_training.label import LabelConfig, training_views
from deepuav_training.losses import (detector_loss, distillation_loss, dual_softmax_loss,
                                     sample_descriptors)
from deepuav_training.models.superpoint_small import SmallSuperPoint, SmallSuperPointConfig

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class LossConfig:
    """Weights of the losses' sum."""

    detector: float = 1.0
    distillation: float = 2.0
    matching: float = 0.3
    temperature: float = 0.07
    exclusion_px: float = 10.0  # nearer points are no counter-examples

    def check(self, where: str) -> None:
        check_field(self.temperature > 0, where, "temperature", self.temperature, "positive")


@dataclass(frozen=True)
class TrainConfig:
    """One training run."""

    labels: str = "configs/labels.yaml"  # the configuration that the labels were made with
    run: str = "runs/superpoint_small"  # folder of the checkpoint and the log
    seed: int = 3
    threads: int = 1
    bfloat16: bool = True  # convolutions in 16 bits
    steps: int = 20000
    batch: int = 8  # pairs of images
    learning_rate: float = 0.003
    warmup: float = 0.02  # share of the schedule
    weight_decay: float = 0.01
    gradient_limit: float = 5.0  # L2 norm
    average_decay: float = 0.998
    checkpoint_s: float = 180.0  # seconds between checkpoints
    log_steps: int = 50
    network: SmallSuperPointConfig = field(default_factory=SmallSuperPointConfig)
    pairs: PairConfig = field(default_factory=PairConfig)
    losses: LossConfig = field(default_factory=LossConfig)

    def check(self, where: str) -> None:
        check_field(self.steps > 0, where, "steps", self.steps, "at least 1")
        check_field(self.batch > 0, where, "batch", self.batch, "at least 1")
        check_field(0 <= self.warmup < 1, where, "warmup", self.warmup, "a share in [0, 1)")


@dataclass(frozen=True)
class Batch:
    """B pairs as tensors: first the B labelled views, then their B warped copies."""

    images: torch.Tensor  # (2B, 1, H, W) in 0..1
    cells: torch.Tensor  # (2B, 65, h, w)
    known: torch.Tensor  # (2B, h, w) bool
    points: torch.Tensor  # (2B, K, 2)
    descriptors: torch.Tensor  # (B, K, C)
    valid: torch.Tensor  # (B, K) bool


def collate(samples: list[Sample]) -> Batch:
    """Stacks samples into a batch."""

    def views_first(name: str) -> torch.Tensor:
        stacked = np.stack([getattr(sample, name) for sample in samples], axis=1)
        return torch.from_numpy(stacked.reshape(-1, *stacked.shape[2:]))

    descriptors = torch.from_numpy(np.stack([sample.descriptors for sample in samples]))
    counts = torch.tensor([sample.count for sample in samples])
    valid = torch.arange(descriptors.shape[1])[None] < counts[:, None]
    return Batch(views_first("images")[:, None].float() / 255, views_first("cells"),
                 views_first("known"), views_first("points"), descriptors, valid)


def losses_of(network: torch.nn.Module, batch: Batch, config: TrainConfig
              ) -> dict[str, torch.Tensor]:
    """Each loss by name, not yet weighted."""
    with torch.autocast("cpu", torch.bfloat16, enabled=config.bfloat16):
        images = batch.images.to(memory_format=torch.channels_last)
        logits, descriptors = network(images)
    height, width = batch.images.shape[-2:]
    a, b = sample_descriptors(descriptors.float(), batch.points, height, width).chunk(2)
    points_a, points_b = batch.points.chunk(2)
    twice = torch.cat([batch.valid, batch.valid])
    teacher = torch.cat([batch.descriptors, batch.descriptors])
    return {
        "detector": detector_loss(logits.float(), batch.cells, batch.known),
        "distillation": distillation_loss(torch.cat([a, b]), teacher, twice),
        "matching": dual_softmax_loss(a, b, points_a, points_b, batch.valid,
                                      config.losses.temperature, config.losses.exclusion_px),
    }


def learning_rate(progress: float, config: TrainConfig) -> float:
    """Linear warm-up, then a cosine down to 1 % of the peak."""
    if progress < config.warmup:
        return config.learning_rate * (progress + 1e-3) / (config.warmup + 1e-3)
    along = (progress - config.warmup) / (1 - config.warmup)
    return config.learning_rate * (0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * min(along, 1.0))))


def train_step(state: TrainingState, batch: Batch, config: TrainConfig) -> dict[str, float]:
    """One step of the optimiser; returns the losses."""
    for group in state.optimiser.param_groups:
        group["lr"] = learning_rate(state.progress, config)
    state.network.train()
    losses = losses_of(state.network, batch, config)
    total = sum(getattr(config.losses, name) * loss for name, loss in losses.items())
    state.optimiser.zero_grad(set_to_none=True)
    total.backward()
    torch.nn.utils.clip_grad_norm_(state.network.parameters(), config.gradient_limit,
                                   error_if_nonfinite=True)
    state.optimiser.step()
    update_average(state.average, state.network, state.step, config.average_decay)
    state.step += 1
    return {name: loss.item() for name, loss in losses.items()}


def new_state(config: TrainConfig) -> TrainingState:
    """An untrained network with its optimiser."""
    torch.manual_seed(config.seed)
    network = SmallSuperPoint(config.network).to(memory_format=torch.channels_last)
    decayed = [p for p in network.parameters() if p.ndim > 1]
    plain = [p for p in network.parameters() if p.ndim <= 1]
    optimiser = torch.optim.AdamW([{"params": decayed, "weight_decay": config.weight_decay},
                                   {"params": plain, "weight_decay": 0.0}],
                                  lr=config.learning_rate)
    return TrainingState(network, copy.deepcopy(network).eval().requires_grad_(False), optimiser)


class Pace:
    """Moves the schedule on: by the number of steps, or so that it ends at a time of the day."""

    def __init__(self, steps: int, until: str | None):
        """`until` as HH:MM; a run bound to the clock cannot be repeated exactly."""
        self._steps, self._until, self._last = steps, None, time.time()
        if until:
            at = datetime.time.fromisoformat(until)
            moment = datetime.datetime.combine(datetime.date.today(), at)
            self._until = moment.timestamp()

    def advance(self, progress: float) -> float:
        if self._until is None:
            return min(1.0, progress + 1 / self._steps)
        now = time.time()
        passed, left = now - self._last, max(self._until - self._last, 1e-3)
        self._last = now
        return min(1.0, progress + (1 - progress) * min(1.0, passed / left))


def train(state: TrainingState, source: PairSource, config: TrainConfig, pace: Pace) -> None:
    """Runs to the end of the schedule, or until a signal asks to stop."""
    checkpoint = Path(config.run) / "checkpoint.pt"
    stop = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.append(True))
    sums, since, saved = {}, time.monotonic(), time.monotonic()
    while state.progress < 1 and not stop:
        first = state.step * config.batch
        batch = collate([source.draw(first + k) for k in range(config.batch)])
        for name, value in train_step(state, batch, config).items():
            sums[name] = sums.get(name, 0.0) + value
        state.progress = pace.advance(state.progress)
        if state.step % config.log_steps == 0:
            now = time.monotonic()
            means = " ".join(f"{name} {total / config.log_steps:.4f}"
                             for name, total in sums.items())
            _LOG.info("step %d (%.1f %%) %s, %.1f images/s", state.step, 100 * state.progress,
                      means, 2 * config.batch * config.log_steps / (now - since))
            sums, since = {}, now
        if time.monotonic() - saved > config.checkpoint_s:
            save_checkpoint(checkpoint, state)
            saved = time.monotonic()
    save_checkpoint(checkpoint, state)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--config", required=True)
    parser.add_argument("--until", metavar="HH:MM",
                        help="fit the rest of the schedule to end then, instead of after `steps`")
    parser.add_argument("--pid-file", type=Path, help="where to write the process's number")
    arguments = parser.parse_args()
    config = load_config(TrainConfig, arguments.config)
    run = Path(config.run)
    run.mkdir(parents=True, exist_ok=True)
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s",
                        handlers=[logging.FileHandler(run / "log.txt"), logging.StreamHandler()])
    if arguments.pid_file:
        arguments.pid_file.write_text(f"{os.getpid()}\n")
    torch.set_num_threads(config.threads)
    torch.use_deterministic_algorithms(True)
    labels = load_config(LabelConfig, config.labels)
    source = PairSource(training_views(labels), labels.images, labels.cache, labels.views,
                        config.pairs, config.seed)
    state = new_state(config)
    if (run / "checkpoint.pt").exists():
        load_checkpoint(run / "checkpoint.pt", state)
    _LOG.info("%d labelled views, from step %d", len(source), state.step)
    train(state, source, config, Pace(config.steps, arguments.until))
    _LOG.info("ended at step %d, %.1f %% of the schedule", state.step, 100 * state.progress)


if __name__ == "__main__":
    main()
