"""Writes a trained SuperGlue as ONNX and checks it against torch.

    python -m deepuav_training.export_superglue --config configs/superglue.yaml --out glue.onnx
"""

import argparse
import copy
import warnings
from pathlib import Path

import numpy as np
import onnx
import torch

from deepuav_training.checkpoint import load_checkpoint
from deepuav_training.config import load_config
from deepuav_training.errors import TrainingError, telling_errors
from deepuav_training.export import rounded_to_16_bits
from deepuav_training.models.superglue import SuperGlue
from deepuav_training.onnx_storage import halve, note_parameters
from deepuav_training.runtime import compiled
from deepuav_training.train_superglue import GlueTrainConfig, new_state

INPUTS = ("keypoints0", "scores0", "descriptors0", "keypoints1", "scores1", "descriptors1")
OUTPUT = "log_assignment"
_OPSET = 17
_CHECKED_COUNTS = ((64, 64), (200, 120))
_TOLERANCE = 5e-3  # of the assignment's probability and, where that is not small, its logarithm
_SMALL = -6.0


def random_inputs(counts: tuple[int, int], dimension: int, seed: int) -> list[np.ndarray]:
    """Key points of which the second view shows the first one's, as far as they go, with noise."""
    rng = np.random.default_rng(seed)
    first = rng.standard_normal((1, max(counts), dimension)).astype(np.float32)
    inputs = []
    for count in counts:
        noisy = first[:, :count] + 0.3 * rng.standard_normal((1, count, dimension))
        inputs += [rng.uniform(-1, 1, (1, count, 2)).astype(np.float32),
                   rng.uniform(0, 1, (1, count)).astype(np.float32),
                   (noisy / np.linalg.norm(noisy, axis=2, keepdims=True)).astype(np.float32)]
    return inputs


def export_onnx(network: SuperGlue, path: Path) -> None:
    """Writes the network with dynamic numbers of key points, weights in 16 bits; the batch is 1."""
    write_matcher(network, network.project.in_features, path)
    model = onnx.load(str(path))
    note_parameters(model, network)
    onnx.save(halve(model), str(path))
    onnx.checker.check_model(str(path))


def write_matcher(network: torch.nn.Module, dimension: int, path: Path) -> None:
    """Writes a matcher of descriptors of that dimension, as export_onnx but in 32 bits."""
    example = tuple(map(torch.from_numpy, random_inputs(_CHECKED_COUNTS[1], dimension, 0)))
    axes = {name: {1: "n" if name.endswith("0") else "m"} for name in INPUTS}
    path.parent.mkdir(parents=True, exist_ok=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.onnx.export(copy.deepcopy(network).eval(), example, str(path), dynamo=False,
                          opset_version=_OPSET, input_names=list(INPUTS), output_names=[OUTPUT],
                          dynamic_axes=axes | {OUTPUT: {1: "n", 2: "m"}})
    onnx.checker.check_model(str(path))


def largest_difference(network: SuperGlue, path: Path) -> float:
    """Between torch and the runtime in float32: of probabilities, and of logarithms not small."""
    run = compiled(path)
    worst = 0.0
    for seed, counts in enumerate(_CHECKED_COUNTS):
        inputs = random_inputs(counts, network.project.in_features, seed)
        with torch.no_grad():
            expected = network.eval()(*map(torch.from_numpy, inputs)).numpy()
        found = run(dict(zip(INPUTS, inputs, strict=True)))[OUTPUT]
        likely = np.maximum(expected, found) > _SMALL
        worst = max(worst, float(np.abs(np.exp(found) - np.exp(expected)).max()),
                    float(np.abs(found - expected)[likely].max(initial=0.0)))
    return worst


def check_export(network: SuperGlue, path: Path) -> float:
    """Raises TrainingError where the file does not compute what the network does."""
    difference = largest_difference(network, path)
    if not difference <= _TOLERANCE:
        raise TrainingError(f"{path}: differs from torch by {difference:.2g}, expected at most "
                            f"{_TOLERANCE}")
    return difference


def count_macs(network: SuperGlue, points: int) -> int:
    """Multiply-accumulate operations of products for `points` key points a side."""
    linear = sum(module.weight.numel() for module in network.modules()
                 if isinstance(module, torch.nn.Linear))
    width = network.project.out_features
    # Two views through all layers; attention is two products of N x N x width in each.
    attention = 2 * 2 * 2 * len(network.self_layers) * points * points * width
    return 2 * points * linear + attention + points * points * width


@telling_errors
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--config", required=True, help="of the training run")
    parser.add_argument("--checkpoint", type=Path, help="instead of the run's own")
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    config = load_config(GlueTrainConfig, arguments.config)
    state = new_state(config, None)
    load_checkpoint(arguments.checkpoint or Path(config.run) / "checkpoint.pt", state)
    network = rounded_to_16_bits(state.average)
    export_onnx(network, arguments.out)
    difference = check_export(network, arguments.out)
    parameters = sum(p.numel() for p in network.parameters())
    print(f"{arguments.out}: step {state.step}, {parameters / 1e6:.3f} M parameters, "
          f"{count_macs(network, 512) / 1e9:.2f} GMAC at 512 points; differs from torch by "
          f"{difference:.1e}")


if __name__ == "__main__":
    main()
