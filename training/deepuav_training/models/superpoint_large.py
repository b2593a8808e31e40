"""The large SuperPoint: the layers of DeTone, Malisiewicz and Rabinovich, "SuperPoint", 2018."""

import torch
import torch.nn.functional as F
from torch import nn

from deepuav_training.models.superpoint_small import DESCRIPTOR, LOGITS

_ENCODER = ((64, 64), (64, 64), (128, 128), (128, 128))  # channels; halved in size in between
_HEAD = 256


class LargeSuperPoint(nn.Module):
    """Image (B, 1, H, W) in 0..1, H and W multiples of 8, to detector logits and descriptors.

    Without normalisation between its layers, as published networks of this layout are exported.
    """

    def __init__(self):
        super().__init__()
        self.encoder, channels = nn.ModuleList(), 1
        for block in _ENCODER:
            layers = []
            for width in block:
                layers += [nn.Conv2d(channels, width, 3, padding=1), nn.ReLU()]
                channels = width
            self.encoder.append(nn.Sequential(*layers))
        self.detector = nn.Sequential(nn.Conv2d(channels, _HEAD, 3, padding=1), nn.ReLU(),
                                      nn.Conv2d(_HEAD, LOGITS, 1))
        self.descriptor = nn.Sequential(nn.Conv2d(channels, _HEAD, 3, padding=1), nn.ReLU(),
                                        nn.Conv2d(_HEAD, DESCRIPTOR, 1))

    def forward(self, image: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Returns logits (B, 65, H/8, W/8) and descriptors (B, 256, H/8, W/8) of length 1."""
        features = image
        for number, block in enumerate(self.encoder):
            features = block(F.max_pool2d(features, 2) if number > 0 else features)
        return self.detector(features), F.normalize(self.descriptor(features), dim=1)
