"""Checkpoints from which training goes on exactly where it stopped."""

from dataclasses import dataclass
from pathlib import Path

import torch
from torch import nn

from deepuav_training.errors import TrainingError
from deepuav_training.onnx_storage import noted_parameters, read_onnx


@dataclass
class TrainingState:
    """Everything that changes while a network is trained."""

    network: nn.Module
    average: nn.Module  # exponential moving average of the weights: what is exported
    optimiser: torch.optim.Optimizer
    step: int = 0
    progress: float = 0.0  # along the learning rate's schedule, 0..1


def save_checkpoint(path: Path, state: TrainingState) -> None:
    """Writes the state whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".partial")
    torch.save({"network": state.network.state_dict(), "average": state.average.state_dict(),
                "optimiser": state.optimiser.state_dict(), "step": state.step,
                "progress": state.progress}, partial)
    partial.replace(path)


def load_checkpoint(path: Path, state: TrainingState) -> None:
    """Sets the state to what save_checkpoint wrote."""
    try:
        saved = torch.load(path, map_location="cpu", weights_only=True)
        state.network.load_state_dict(saved["network"])
        state.average.load_state_dict(saved["average"])
        state.optimiser.load_state_dict(saved["optimiser"])
        state.step, state.progress = saved["step"], saved["progress"]
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        raise TrainingError(f"{path}: found no checkpoint of this network: {error}") from error


def start_from(path: Path, state: TrainingState, added: tuple = ()) -> None:
    """Sets the weights alone: the start of another run.

    Args:
        path: a checkpoint, of which the averaged weights are taken, or an exported file that notes
            which of its constants is which parameter.
        state: whose weights are set.
        added: beginnings of the names of parameters that the file may lack, which stay as they are.
    """
    try:
        if path.suffix == ".onnx":
            average = {name: torch.from_numpy(value) for name, value
                       in noted_parameters(read_onnx(path), str(path)).items()}
        else:
            average = torch.load(path, map_location="cpu", weights_only=True)["average"]
        new = {name: value for name, value in state.average.state_dict().items()
               if added and name.startswith(added) and name not in average}
        state.network.load_state_dict(average | new)
        state.average.load_state_dict(average | new)
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        raise TrainingError(f"{path}: found no checkpoint of this network: {error}") from error


@torch.no_grad()
def update_average(average: nn.Module, network: nn.Module, step: int, decay: float) -> None:
    """Moves the averaged weights and statistics towards the network's, faster at the start."""
    weight = 1 - min(decay, (1 + step) / (10 + step))
    for mean, value in zip(average.state_dict().values(), network.state_dict().values(),
                           strict=True):
        if mean.is_floating_point():
            mean.lerp_(value, weight)
        else:
            mean.copy_(value)
