"""The small SuperPoint: one encoder to 1/8 size, with a shortcut for fine detail to the detector.

Layout of inputs and outputs as in DeTone, Malisiewicz and Rabinovich, "SuperPoint", 2018.
"""

from dataclasses import dataclass

import torch
import torch.nn.functional as F
from torch import nn

from deepuav_training.config import check_field
from deepuav_training.keypoints import CELL

LOGITS = CELL * CELL + 1  # the pixels of a cell, row-major, and "no point"
DESCRIPTOR = 256
_NO_POINT_BIAS = 5.0  # a new network sees few points


@dataclass(frozen=True)
class SmallSuperPointConfig:
    """Channels of the network's stages."""

    half: int = 16  # at 1/2 of the image's size
    quarter: int = 32  # at 1/4
    eighth: int = 64  # at 1/8, first block
    deep: int = 96  # at 1/8, second block
    detail: int = 64  # of the detail path at 1/8
    head: int = 96  # of the detector's hidden layers
    descriptor_hidden: int = 128
    quarter_detail: int = 0  # of the detail path from 1/4 to 1/8; 0: none

    def check(self, where: str) -> None:
        for name, value in vars(self).items():
            least = 0 if name == "quarter_detail" else 1
            check_field(value >= least, where, name, value, f"at least {least} channels")


class SmallSuperPoint(nn.Module):
    """Image (B, 1, H, W) in 0..1, H and W multiples of 8, to detector logits and descriptors."""

    def __init__(self, config: SmallSuperPointConfig = SmallSuperPointConfig()):
        super().__init__()
        c = config
        self.at_half = nn.Sequential(_convolution(1, c.half, 3, 2), _convolution(c.half, c.half, 3))
        self.at_quarter = nn.Sequential(_convolution(c.half, c.quarter, 3, 2), Residual(c.quarter))
        self.at_eighth = nn.Sequential(_convolution(c.quarter, c.eighth, 3, 2), Residual(c.eighth),
                                    _convolution(c.eighth, c.deep, 3), Residual(c.deep))
        # A kernel as large as its stride is a space-to-depth fold and a mixing of its channels.
        self.image_detail = _convolution(1, c.detail // 2, CELL, CELL)
        self.half_detail = _convolution(c.half, c.detail, CELL // 2, CELL // 2)
        self.quarter_detail = (_convolution(c.quarter, c.quarter_detail, CELL // 4, CELL // 4)
                               if c.quarter_detail else None)
        self.detector = nn.Sequential(
            _convolution(c.deep + c.detail // 2 + c.detail + c.quarter_detail, c.head, 1),
            _convolution(c.head, c.head, 3), nn.Conv2d(c.head, LOGITS, 1))
        self.descriptor = nn.Sequential(_convolution(c.deep, c.descriptor_hidden, 1),
                                        nn.Conv2d(c.descriptor_hidden, DESCRIPTOR, 1))
        with torch.no_grad():
            self.detector[-1].bias.zero_()
            self.detector[-1].bias[-1] = _NO_POINT_BIAS

    def forward(self, image: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Returns logits (B, 65, H/8, W/8) and descriptors (B, 256, H/8, W/8) of length 1."""
        half = self.at_half(image)
        quarter = self.at_quarter(half)
        deep = self.at_eighth(quarter)
        features = [deep, self.image_detail(image), self.half_detail(half)]
        if self.quarter_detail is not None:
            features.append(self.quarter_detail(quarter))
        logits = self.detector(torch.cat(features, dim=1))
        return logits, F.normalize(self.descriptor(deep), dim=1)


class Residual(nn.Module):
    """Two 3x3 convolutions beside a shortcut; starts as the identity."""

    def __init__(self, channels: int):
        super().__init__()
        self.first = _convolution(channels, channels, 3)
        self.second = _convolution(channels, channels, 3, activate=False)
        nn.init.zeros_(self.second[1].weight)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return F.relu(x + self.second(self.first(x)))


def _convolution(inputs: int, outputs: int, size: int, stride: int = 1, activate: bool = True
                 ) -> nn.Sequential:
    padding = 0 if size == stride else size // 2
    layers = [nn.Conv2d(inputs, outputs, size, stride, padding, bias=False),
              nn.BatchNorm2d(outputs)]
    return nn.Sequential(*layers, *([nn.ReLU()] if activate else []))


def count_macs(network: nn.Module, height: int, width: int) -> int:
    """Multiply-accumulate operations of the convolutions for one image."""
    total = 0

    def add(module: nn.Conv2d, _inputs: tuple, output: torch.Tensor) -> None:
        nonlocal total
        total += module.weight.numel() * output.shape[-2] * output.shape[-1]

    hooks = [module.register_forward_hook(add) for module in network.modules()
             if isinstance(module, nn.Conv2d)]
    training = network.training
    with torch.no_grad():
        network.eval()(torch.zeros(1, 1, height, width))
    network.train(training)
    for hook in hooks:
        hook.remove()
    return total
