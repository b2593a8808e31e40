"""Writes a trained SuperPoint as ONNX and checks it against torch.

    python -m deepuav_training.export --config configs/superpoint_small.yaml --out small.onnx
"""

import argparse
import copy
import warnings
from pathlib import Path

import numpy as np
import onnx
import torch
from torch import nn

from deepuav_training.checkpoint import load_checkpoint
from deepuav_training.config import load_config
from deepuav_training.errors import TrainingError, telling_errors
from deepuav_training.models.superpoint_small import count_macs
from deepuav_training.keypoints import unit_descriptors
from deepuav_training.onnx_storage import LEAST_VALUES, halve, without_norm
from deepuav_training.runtime import compiled
from deepuav_training.train_superpoint import TrainConfig, new_state

_OPSET = 17
_CHECKED_SIZES = ((240, 320), (88, 136))  # height, width
_LOGITS_TOLERANCE = 2e-3
_DESCRIPTOR_TOLERANCE = 1e-4


def export_onnx(network: nn.Module, path: Path, in_16_bits: bool = False) -> None:
    """Writes the network with dynamic batch, height and width; its weights in 32 or 16 bits.

    The file's descriptors are of any length: who samples them brings them to length 1.
    """
    network = copy.deepcopy(network).eval().to(memory_format=torch.contiguous_format)
    cells = {0: "batch", 2: "rows", 3: "columns"}
    path.parent.mkdir(parents=True, exist_ok=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        torch.onnx.export(network, torch.zeros(1, 1, *_CHECKED_SIZES[0]), str(path), dynamo=False,
                          opset_version=_OPSET, input_names=["image"],
                          output_names=["logits", "descriptors"],
                          dynamic_axes={"image": {0: "batch", 2: "height", 3: "width"},
                                        "logits": cells, "descriptors": cells})
    model = without_norm(onnx.load(str(path)))
    onnx.save(halve(model) if in_16_bits else model, str(path))
    onnx.checker.check_model(str(path))


def largest_differences(network: nn.Module, path: Path) -> tuple[float, float]:
    """Largest difference of logits and of descriptors between torch and the runtime in float32."""
    run = compiled(path)
    generator = np.random.default_rng(0)
    worst = np.zeros(2)
    for height, width in _CHECKED_SIZES:
        image = generator.random((1, 1, height, width), dtype=np.float32)
        with torch.no_grad():
            expected = network.eval()(torch.from_numpy(image))
        found = run({"image": image})
        found["descriptors"] = unit_descriptors(found["descriptors"], axis=1)
        worst = np.maximum(worst, [np.abs(found[name] - value.numpy()).max() for name, value
                                   in zip(("logits", "descriptors"), expected, strict=True)])
    return float(worst[0]), float(worst[1])


def check_export(network: nn.Module, path: Path) -> tuple[float, float]:
    """Raises TrainingError where the file does not compute what the network does."""
    logits, descriptors = largest_differences(network, path)
    if logits > _LOGITS_TOLERANCE or descriptors > _DESCRIPTOR_TOLERANCE:
        raise TrainingError(f"{path}: logits differ from torch by {logits:.2g}, descriptors by "
                            f"{descriptors:.2g}, expected at most {_LOGITS_TOLERANCE} and "
                            f"{_DESCRIPTOR_TOLERANCE}")
    return logits, descriptors


@torch.no_grad()
def rounded_to_16_bits(network: nn.Module) -> nn.Module:
    """A copy with the weights that a file stored in 16 bits has."""
    network = copy.deepcopy(network)
    for parameter in network.parameters():
        if parameter.numel() >= LEAST_VALUES:
            parameter.copy_(parameter.half().float())
    return network


@telling_errors
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--config", required=True, help="of the training run")
    parser.add_argument("--checkpoint", type=Path, help="instead of the run's own")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--in-16-bits", action="store_true",
                        help="store the weights in 16 bits: half the size")
    arguments = parser.parse_args()
    config = load_config(TrainConfig, arguments.config)
    state = new_state(config)
    load_checkpoint(arguments.checkpoint or Path(config.run) / "checkpoint.pt", state)
    network = rounded_to_16_bits(state.average) if arguments.in_16_bits else state.average
    export_onnx(network, arguments.out, arguments.in_16_bits)
    logits, descriptors = check_export(network, arguments.out)
    parameters = sum(p.numel() for p in network.parameters())
    print(f"{arguments.out}: step {state.step}, {parameters / 1e6:.3f} M parameters, "
          f"{count_macs(network, 480, 752) / 1e9:.2f} GMAC at 752x480; differs from torch by "
          f"{logits:.1e} (logits) and {descriptors:.1e} (descriptors)")


if __name__ == "__main__":
    main()
