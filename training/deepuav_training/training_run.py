"""What all training runs share: schedule, optimiser, log and checkpoints.

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
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import nn

from deepuav_training.checkpoint import (TrainingState, load_checkpoint, save_checkpoint,
                                         start_from, update_average)
from deepuav_training.config import check_field
from deepuav_training.errors import TrainingError

_LOG = logging.getLogger(__name__)
DEVICES = ("cpu", "cuda")


@dataclass(frozen=True)
class Objective:
    """What is minimised: the weighted sum of losses of a network in a step's batch."""

    losses: Callable[[nn.Module, int], dict[str, torch.Tensor]]  # (network, step) -> by name
    weights: dict[str, float]


@dataclass(frozen=True)
class RunConfig:
    """One training run, of whatever network."""

    run: str = "runs/run"  # folder of the checkpoint and the log
    added: tuple = ()  # beginnings of the names of parameters that a file of --init lacks
    seed: int = 3
    device: str = "cpu"  # that the network is trained on: cpu or cuda
    threads: int = 1
    bfloat16: bool = True  # products in 16 bits, where the device computes in them
    steps: int = 20000
    batch: int = 8  # pairs of images
    learning_rate: float = 0.003
    warmup: float = 0.02  # share of the schedule
    weight_decay: float = 0.01
    gradient_limit: float = 5.0  # L2 norm
    average_decay: float = 0.998
    checkpoint_s: float = 180.0  # seconds between checkpoints
    log_steps: int = 50

    def check(self, where: str) -> None:
        check_field(self.device in DEVICES, where, "device", self.device, " or ".join(DEVICES))
        check_field(self.steps > 0, where, "steps", self.steps, "at least 1")
        check_field(self.batch > 0, where, "batch", self.batch, "at least 1")
        check_field(0 <= self.warmup < 1, where, "warmup", self.warmup, "a share in [0, 1)")


def in_16_bits(config: RunConfig) -> torch.autocast:
    """Products in bfloat16 if asked for, on devices that compute in it: others only emulate it."""
    able = config.device != "cpu" or torch.cpu._is_avx512_bf16_supported()
    return torch.autocast(config.device, torch.bfloat16, enabled=config.bfloat16 and able)


def training_state(network: nn.Module, config: RunConfig) -> TrainingState:
    """The start of a run of this network: AdamW, without decay of biases and of norms' gains."""
    decayed = [p for p in network.parameters() if p.ndim > 1]
    plain = [p for p in network.parameters() if p.ndim <= 1]
    optimiser = torch.optim.AdamW([{"params": decayed, "weight_decay": config.weight_decay},
                                   {"params": plain, "weight_decay": 0.0}],
                                  lr=config.learning_rate)
    return TrainingState(network, copy.deepcopy(network).eval().requires_grad_(False), optimiser)


def learning_rate(progress: float, config: RunConfig) -> float:
    """Linear warm-up, then a cosine down to 1 % of the peak."""
    if progress < config.warmup:
        return config.learning_rate * (progress + 1e-3) / (config.warmup + 1e-3)
    along = (progress - config.warmup) / (1 - config.warmup)
    return config.learning_rate * (0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * min(along, 1.0))))


def next_moment(clock: str, now: datetime.datetime) -> datetime.datetime:
    """When it is HH:MM next: today, or tomorrow where that has passed."""
    moment = datetime.datetime.combine(now.date(), datetime.time.fromisoformat(clock))
    return moment if moment > now else moment + datetime.timedelta(days=1)


class Pace:
    """Moves the schedule on: by the number of steps, or so that it ends at a moment."""

    def __init__(self, steps: int, until: float | None):
        """`until` as time.time() has it; a run bound to the clock cannot be repeated exactly."""
        self._steps, self._until, self._last = steps, until, time.time()

    def advance(self, progress: float) -> float:
        """The schedule's share (0..1) that is done after one more step."""
        if self._until is None:
            return min(1.0, (round(progress * self._steps) + 1) / self._steps)
        now = time.time()
        passed, left = now - self._last, max(self._until - self._last, 1e-3)
        self._last = now
        return min(1.0, progress + (1 - progress) * min(1.0, passed / left))


def train_step(state: TrainingState, objective: Objective, config: RunConfig) -> dict[str, float]:
    """One step of the optimiser; returns the losses, not weighted."""
    for group in state.optimiser.param_groups:
        group["lr"] = learning_rate(state.progress, config)
    state.network.train()
    losses = objective.losses(state.network, state.step)
    state.optimiser.zero_grad(set_to_none=True)
    sum(objective.weights[name] * loss for name, loss in losses.items()).backward()
    nn.utils.clip_grad_norm_(state.network.parameters(), config.gradient_limit,
                             error_if_nonfinite=True)
    state.optimiser.step()
    update_average(state.average, state.network, state.step, config.average_decay)
    state.step += 1
    return {name: loss.item() for name, loss in losses.items()}


def train(state: TrainingState, objective: Objective, config: RunConfig, pace: Pace) -> None:
    """Runs to the end of the schedule, or until a signal asks to stop."""
    checkpoint = Path(config.run) / "checkpoint.pt"
    stop = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.append(True))
    sums, steps, since, saved = {}, 0, time.monotonic(), time.monotonic()
    while state.progress < 1 and not stop:
        for name, value in train_step(state, objective, config).items():
            sums[name] = sums.get(name, 0.0) + value
        steps += 1
        state.progress = pace.advance(state.progress)
        if state.step % config.log_steps == 0:
            now = time.monotonic()
            means = " ".join(f"{name} {total / steps:.4f}" for name, total in sums.items())
            _LOG.info("step %d (%.1f %%) %s, %.1f pairs/s", state.step, 100 * state.progress,
                      means, config.batch * steps / (now - since))
            sums, steps, since = {}, 0, now
        if time.monotonic() - saved > config.checkpoint_s:
            save_checkpoint(checkpoint, state)
            saved = time.monotonic()
    save_checkpoint(checkpoint, state)


def run_arguments(description: str) -> argparse.ArgumentParser:
    """The command line of a training stage."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--config", required=True)
    parser.add_argument("--init", type=Path, metavar="FILE",
                        help="the weights that a new run starts from: a checkpoint of an earlier "
                             "one, or an exported ONNX file")
    end = parser.add_mutually_exclusive_group()
    end.add_argument("--until", metavar="HH:MM",
                     help="fit the rest of the schedule to end then, instead of after `steps`")
    end.add_argument("--seconds", type=float, metavar="S",
                     help="the same, so long after the first step")
    parser.add_argument("--pid-file", type=Path, help="where to write the process's number")
    return parser


def end_of(arguments: argparse.Namespace) -> float | None:
    """When the schedule is to end, as time.time() has it; None: after its steps."""
    if arguments.until:
        return next_moment(arguments.until, datetime.datetime.now()).timestamp()
    return None if arguments.seconds is None else time.time() + arguments.seconds


def start_run(config: RunConfig, arguments: argparse.Namespace) -> None:
    """Opens the run's folder and log, and sets what makes a run repeatable."""
    run = Path(config.run)
    run.mkdir(parents=True, exist_ok=True)
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s",
                        handlers=[logging.FileHandler(run / "log.txt"), logging.StreamHandler()])
    if arguments.pid_file:
        arguments.pid_file.write_text(f"{os.getpid()}\n")
    if config.device == "cuda" and not torch.cuda.is_available():
        raise TrainingError(f"{arguments.config}: device: found cuda, expected cpu, since PyTorch "
                            "finds no GPU here")
    torch.set_num_threads(config.threads)
    torch.use_deterministic_algorithms(config.device == "cpu")  # slow or missing on a GPU
    torch.manual_seed(config.seed)


def finish_run(state: TrainingState, objective: Objective, config: RunConfig,
               arguments: argparse.Namespace,
               start: Callable[[Path, TrainingState, tuple], None] = start_from) -> None:
    """Goes on from the run's checkpoint, or from --init by `start`, to the end of the schedule."""
    checkpoint = Path(config.run) / "checkpoint.pt"
    for network in (state.network, state.average):
        network.to(config.device)
    if checkpoint.exists():
        load_checkpoint(checkpoint, state)
    elif arguments.init:
        start(arguments.init, state, tuple(config.added))
        _LOG.info("weights of %s", arguments.init)
    _LOG.info("from step %d", state.step)
    train(state, objective, config, Pace(config.steps, end_of(arguments)))
    _LOG.info("ended at step %d, %.1f %% of the schedule", state.step, 100 * state.progress)
