"""Starting a network from an exported file, whose batch normalisations are folded away."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from torch import nn

from deepuav_training.errors import TrainingError
from deepuav_training.onnx_storage import constants, read_onnx


def load_exported(path: Path, network: nn.Module, images: torch.Tensor,
                  added: tuple[str, ...] = ()) -> None:
    """Sets the network's weights to those of its exported file.

    Export folds each batch normalisation into its convolution. Here each gets the mean and the
    variance of what it is fed for `images`, and the gain and bias that undo them: the network
    computes what the file does, and goes on training as if it had never been exported. A convolution
    that takes more channels than the file's starts with nothing from the further ones.

    Args:
        path: the ONNX file of a network of the same layers.
        network: convolutions, each followed by at most one batch normalisation.
        images: (B, 1, H, W) in 0..1, as varied as the training data.
        added: beginnings of the names of layers that the file lacks, which stay as they are.
    """
    folded = _folded_convolutions(path)
    new = {module for name, module in network.named_modules() if added and name.startswith(added)}
    layers = [(convolution, norm) for convolution, norm in _in_order_of_use(network, images)
              if convolution not in new]
    if len(folded) != len(layers) or not all(
            _fits(weight.shape, c.weight.shape) for (weight, _), (c, _) in
            zip(folded, layers, strict=True)):
        raise TrainingError(f"{path}: found {len(folded)} convolutions of other shapes, expected "
                            f"{len(layers)} of the network")
    with torch.no_grad():
        for (convolution, norm), (weight, bias) in zip(layers, folded, strict=True):
            convolution.weight.zero_()[:, : weight.shape[1]].copy_(torch.from_numpy(weight))
            if norm is None:
                convolution.bias.copy_(torch.from_numpy(bias))
            else:
                _pass_through(norm, torch.from_numpy(bias))
        _take_statistics(network, layers, images)


def _fits(stored: tuple, wanted: torch.Size) -> bool:
    """Whether weights (out, in, height, width) are those of a layer, of its first inputs at least."""
    return (stored[0] == wanted[0] and stored[1] <= wanted[1]
            and tuple(stored[2:]) == tuple(wanted[2:]))


def _folded_convolutions(path: Path) -> list[tuple[np.ndarray, np.ndarray]]:
    """Weights and biases in the order of the file's graph, which is that of their use."""
    model = read_onnx(path)
    graph, values = model.graph, constants(model)
    nodes = [node for node in graph.node if node.op_type == "Conv"]
    if not all(len(node.input) == 3 and set(node.input[1:]) <= values.keys() for node in nodes):
        raise TrainingError(f"{path}: found convolutions without constant weights and bias, "
                            "expected an exported network")
    return [(values[node.input[1]].copy(), values[node.input[2]].copy()) for node in nodes]


def _in_order_of_use(network: nn.Module, images: torch.Tensor
                     ) -> list[tuple[nn.Conv2d, nn.BatchNorm2d | None]]:
    """The convolutions as they are called, each with the normalisation that follows it."""
    called = []
    _run(network, images[:1], {nn.Conv2d: lambda module, *_: called.append([module, None]),
                               nn.BatchNorm2d: lambda module, *_: called[-1].__setitem__(1, module)})
    return [(convolution, norm) for convolution, norm in called]


def _pass_through(norm: nn.BatchNorm2d, bias: torch.Tensor) -> None:
    norm.running_mean.zero_()
    norm.running_var.fill_(1 - norm.eps)
    norm.weight.fill_(1)
    norm.bias.copy_(bias)


def _take_statistics(network: nn.Module, layers: list, images: torch.Tensor) -> None:
    """Gives each normalisation the statistics of its input, and the gain and bias that undo it."""
    statistics = {}

    def measure(norm: nn.BatchNorm2d, inputs: tuple, _output: torch.Tensor) -> None:
        statistics[norm] = (inputs[0].mean(dim=(0, 2, 3)), inputs[0].var(dim=(0, 2, 3), correction=0))

    _run(network, images, {nn.BatchNorm2d: measure})
    for _, norm in layers:
        if norm is None:
            continue
        mean, variance = statistics[norm]
        norm.running_mean.copy_(mean)
        norm.running_var.copy_(variance)
        norm.weight.copy_((variance + norm.eps).sqrt())
        norm.bias.add_(mean)


@torch.no_grad()
def _run(network: nn.Module, images: torch.Tensor, hooks: dict[type, Callable]) -> None:
    """Runs the network as it is used, calling a hook after each layer of its kind."""
    handles = [module.register_forward_hook(hook) for module in network.modules()
               for kind, hook in hooks.items() if isinstance(module, kind)]
    training = network.training
    network.eval()(images)
    network.train(training)
    for handle in handles:
        handle.remove()
