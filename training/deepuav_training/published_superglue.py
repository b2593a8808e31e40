"""SuperGlue as it was published, with random weights: to compare the time it takes.

    python -m deepuav_training.published_superglue --out published_superglue.onnx

Sarlin, DeTone, Malisiewicz and Rabinovich, "SuperGlue: Learning Feature Matching with Graph Neural
Networks", 2020, section 3 and appendix: descriptors of 256, 18 layers of alternating self- and
cross-attention with four heads. Without the Sinkhorn iterations at its end, and with the batch
normalisations folded away, so no slower than it needs to be.
"""

import argparse
from pathlib import Path

import torch
import torch.nn.functional as F
from torch import nn

from deepuav_training.errors import telling_errors
from deepuav_training.export_superglue import write_matcher
from deepuav_training.models.superglue import join_heads, split_heads

_WIDTH = 256
_HEADS = 4
_LAYERS = 18
_ENCODER = (3, 32, 64, 128, 256, _WIDTH)


def perceptron(widths: tuple[int, ...]) -> nn.Sequential:
    """Linear layers of these widths with ReLU in between."""
    layers = []
    for before, after in zip(widths, widths[1:]):
        layers += [nn.Linear(before, after), nn.ReLU()]
    return nn.Sequential(*layers[:-1])


class Layer(nn.Module):
    """A message from `source` to each key point, and what it makes of it."""

    def __init__(self):
        super().__init__()
        self.q, self.k, self.v, self.merge = (nn.Linear(_WIDTH, _WIDTH) for _ in range(4))
        self.update = perceptron((2 * _WIDTH, 2 * _WIDTH, _WIDTH))

    def forward(self, x: torch.Tensor, source: torch.Tensor) -> torch.Tensor:
        q, k, v = (split_heads(t, _HEADS) for t in (self.q(x), self.k(source), self.v(source)))
        message = self.merge(join_heads(F.scaled_dot_product_attention(q, k, v)))
        return x + self.update(torch.cat([x, message], dim=2))


class PublishedSuperGlue(nn.Module):
    """The inputs of the project's SuperGlue to scores (B, N, M), before the optimal transport."""

    def __init__(self):
        super().__init__()
        self.encode = perceptron(_ENCODER)
        self.layers = nn.ModuleList(Layer() for _ in range(_LAYERS))
        self.project = nn.Linear(_WIDTH, _WIDTH)

    def forward(self, keypoints0, scores0, descriptors0, keypoints1, scores1, descriptors1
                ) -> torch.Tensor:
        """Arguments as SuperGlue.forward's."""
        x0, x1 = (descriptors + self.encode(torch.cat([keypoints, scores[:, :, None]], dim=2))
                  for keypoints, scores, descriptors in (
                      (keypoints0, scores0, descriptors0), (keypoints1, scores1, descriptors1)))
        for number, layer in enumerate(self.layers):
            is_cross = number % 2 == 1
            x0, x1 = layer(x0, x1 if is_cross else x0), layer(x1, x0 if is_cross else x1)
        return self.project(x0) @ self.project(x1).transpose(1, 2) / _WIDTH**0.5


@telling_errors
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    torch.manual_seed(0)
    write_matcher(PublishedSuperGlue(), _WIDTH, arguments.out)


if __name__ == "__main__":
    main()
