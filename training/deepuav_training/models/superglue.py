"""SuperGlue: a matcher that sees all key points of both images at once.

After Sarlin, DeTone, Malisiewicz and Rabinovich, "SuperGlue", 2020; rotary positions and the
matchability in place of a dustbin after Lindenberger, Sarlin and Pollefeys, "LightGlue", 2023.
Every layer only adds to the projected descriptors, and adds nothing before it is trained: a new
network is the dual-softmax matcher.
"""

import math
from dataclasses import dataclass

import torch
import torch.nn.functional as F
from torch import nn

from deepuav_training.config import check_field

_MASKED = -1e4
_LEAST_SCORE = 1e-5
_HIGHEST_FREQUENCY = 30.0  # radians per half of the image's longer side
_CROSS_GAIN = 1.5  # of new queries and keys: likeness alone already points to the counterpart


@dataclass(frozen=True)
class SuperGlueConfig:
    """Sizes of the network."""

    descriptor: int = 256  # of the key points
    width: int = 128  # of the network
    heads: int = 4
    layers: int = 4  # each a self- and a cross-attention
    hidden: int = 192  # of the perceptron behind each attention
    temperature: float = 0.05  # of a new network: similarity is cosine / temperature
    matchable: float = 0.7  # logit of a new network's matchability

    def check(self, where: str) -> None:
        check_field(self.heads > 0 and self.width % (4 * self.heads) == 0, where, "width",
                    self.width, "a multiple of four times the heads")
        check_field(self.layers >= 0, where, "layers", self.layers, "at least 0")
        check_field(self.hidden > 0, where, "hidden", self.hidden, "at least 1")
        check_field(self.temperature > 0, where, "temperature", self.temperature, "positive")


class SuperGlue(nn.Module):
    """Key points of two images to the probability that two show the same thing.

    Positions are (pixel - size / 2) / (longer side / 2), scores the detector's probabilities,
    descriptors of length 1.
    """

    def __init__(self, config: SuperGlueConfig = SuperGlueConfig()):
        super().__init__()
        c = config
        self.project = nn.Linear(c.descriptor, c.width, bias=False)
        self.encode = KeypointEncoder(c.width)
        self.rotary = Rotary(c.width // c.heads)
        self.self_layers = nn.ModuleList(SelfLayer(c) for _ in range(c.layers))
        self.cross_layers = nn.ModuleList(CrossLayer(c) for _ in range(c.layers))
        self.similar = nn.Linear(c.width, c.width, bias=False)
        self.matchable = nn.Linear(c.width, 1)
        self._scale = math.sqrt(c.width)  # brings the entries of unit vectors to about 1
        with torch.no_grad():
            nn.init.orthogonal_(self.project.weight)
            self.similar.weight.copy_(torch.eye(c.width)
                                      / (self._scale * math.sqrt(c.temperature)))
            self.matchable.weight.zero_()
            self.matchable.bias.fill_(c.matchable)

    def forward(self, keypoints0: torch.Tensor, scores0: torch.Tensor, descriptors0: torch.Tensor,
                keypoints1: torch.Tensor, scores1: torch.Tensor, descriptors1: torch.Tensor,
                mask0: torch.Tensor | None = None, mask1: torch.Tensor | None = None
                ) -> torch.Tensor:
        """Logarithm (B, N, M) of the assignment probability.

        Args:
            keypoints0: (B, N, 2); keypoints1: (B, M, 2).
            scores0: (B, N); scores1: (B, M).
            descriptors0: (B, N, C); descriptors1: (B, M, C).
            mask0, mask1: (B, N) and (B, M), 1 for key points and 0 for padding, or neither.
        """
        *_, last = self.states(keypoints0, scores0, descriptors0, keypoints1, scores1,
                               descriptors1, mask0, mask1)
        return self.assign(*last, mask0, mask1)[0]

    def states(self, keypoints0, scores0, descriptors0, keypoints1, scores1, descriptors1,
               mask0=None, mask1=None) -> list[tuple[torch.Tensor, torch.Tensor]]:
        """The key points' states (B, N, width), (B, M, width): at first, and after each layer."""
        bias0, bias1 = padding_bias(mask0), padding_bias(mask1)
        x0, x1 = (self._scale * self.project(d) for d in (descriptors0, descriptors1))
        with in_full_precision(x0):
            e0, e1 = self.encode(keypoints0, scores0), self.encode(keypoints1, scores1)
            turn0, turn1 = self.rotary(keypoints0), self.rotary(keypoints1)
        states = [(x0, x1)]
        for within, between in zip(self.self_layers, self.cross_layers, strict=True):
            x0, x1 = within(x0, e0, turn0, bias0), within(x1, e1, turn1, bias1)
            x0, x1 = between(x0, e0, x1, e1, bias0, bias1)
            states.append((x0, x1))
        return states

    def assign(self, x0: torch.Tensor, x1: torch.Tensor, mask0: torch.Tensor | None = None,
               mask1: torch.Tensor | None = None
               ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """From states: log assignment (B, N, M) and the logits of matchability (B, N), (B, M)."""
        with in_full_precision(x0):
            similarity = self.similar(x0.float()) @ self.similar(x1.float()).transpose(1, 2)
        if mask0 is not None:
            similarity = similarity + _MASKED * (1 - mask0[:, :, None] * mask1[:, None, :])
        z0, z1 = (self.matchable(x).float().squeeze(2) for x in (x0, x1))
        both = F.log_softmax(similarity, dim=1) + F.log_softmax(similarity, dim=2)
        return both + F.logsigmoid(z0)[:, :, None] + F.logsigmoid(z1)[:, None, :], z0, z1

    @torch.no_grad()
    def set_projection(self, descriptors: torch.Tensor) -> float:
        """Projects onto the principal axes of descriptors (K, C); returns the energy kept, 0..1."""
        values, axes = torch.linalg.eigh(descriptors.T.double() @ descriptors.double())
        width = self.project.out_features
        self.project.weight.copy_(axes[:, -width:].T)
        return float(values[-width:].sum() / values.sum())


def in_full_precision(x: torch.Tensor) -> torch.autocast:
    """Where 16 bits would blur positions by tenths of a pixel, or likelihoods that are close."""
    return torch.autocast(x.device.type, enabled=False)


class KeypointEncoder(nn.Module):
    """Positions (B, N, 2) and scores (B, N) to (B, N, width)."""

    def __init__(self, width: int):
        super().__init__()
        self.frequencies = nn.Parameter(spread_frequencies(width // 4))
        self.mix = nn.Sequential(nn.Linear(width // 2 + 3, width), nn.GELU(),
                                 nn.Linear(width, width))

    def forward(self, keypoints: torch.Tensor, scores: torch.Tensor) -> torch.Tensor:
        angles = keypoints @ self.frequencies.T
        score = torch.log(scores.clamp(min=_LEAST_SCORE))[:, :, None] / 4 + 1
        return self.mix(torch.cat([angles.cos(), angles.sin(), keypoints, score], dim=2))


class Rotary(nn.Module):
    """Turns pairs of a query's and key's entries by angles linear in the position.

    Their product then depends on differences of positions alone (Su et al., "RoFormer", 2021).
    """

    def __init__(self, head: int):
        super().__init__()
        self.frequencies = nn.Parameter(spread_frequencies(head // 2))

    def forward(self, keypoints: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Cosines and sines (B, 1, N, head / 2) for positions (B, N, 2)."""
        angles = (keypoints @ self.frequencies.T)[:, None]
        return angles.cos(), angles.sin()


def spread_frequencies(count: int) -> torch.Tensor:
    """Frequencies (count, 2): lengths spread evenly by their logarithm, directions by the angle."""
    length = torch.logspace(0, math.log10(_HIGHEST_FREQUENCY), count)
    angle = torch.arange(count) * (math.pi * (3 - math.sqrt(5)))  # the golden angle
    return length[:, None] * torch.stack([angle.cos(), angle.sin()], dim=1)


def rotate(x: torch.Tensor, turn: tuple[torch.Tensor, torch.Tensor]) -> torch.Tensor:
    """Turns (B, heads, N, head) as Rotary says."""
    cosine, sine = (t.to(x.dtype) for t in turn)
    a, b = x.chunk(2, dim=3)
    return torch.cat([a * cosine - b * sine, a * sine + b * cosine], dim=3)


def padding_bias(mask: torch.Tensor | None) -> torch.Tensor | None:
    """Mask (B, N) to what is added to attention's logits (B, 1, 1, N)."""
    return None if mask is None else _MASKED * (1 - mask[:, None, None, :])


class Update(nn.Module):
    """What a key point makes of its state and a message; nothing, before it is trained."""

    def __init__(self, c: SuperGlueConfig):
        super().__init__()
        self.first = nn.Linear(2 * c.width, c.hidden)
        self.norm = nn.LayerNorm(c.hidden)
        self.last = nn.Linear(c.hidden, c.width)
        nn.init.zeros_(self.last.weight)
        nn.init.zeros_(self.last.bias)

    def forward(self, state: torch.Tensor, message: torch.Tensor) -> torch.Tensor:
        return self.last(F.gelu(self.norm(self.first(torch.cat([state, message], dim=2)))))


class SelfLayer(nn.Module):
    """Attention among the key points of one image."""

    def __init__(self, c: SuperGlueConfig):
        super().__init__()
        self.heads = c.heads
        self.norm = nn.LayerNorm(c.width)
        self.qkv = nn.Linear(c.width, 3 * c.width)
        self.update = Update(c)

    def forward(self, x: torch.Tensor, encoding: torch.Tensor, turn: tuple, bias) -> torch.Tensor:
        state = self.norm(x) + encoding
        q, k, v = (split_heads(t, self.heads) for t in self.qkv(state).chunk(3, dim=2))
        message = attend(rotate(q, turn), rotate(k, turn), v, bias)
        return x + self.update(state, join_heads(message))


class CrossLayer(nn.Module):
    """Attention of each image's key points to the other's; queries and keys are the same."""

    def __init__(self, c: SuperGlueConfig):
        super().__init__()
        self.heads = c.heads
        self.norm = nn.LayerNorm(c.width)
        self.qk = nn.Linear(c.width, c.width)
        self.v = nn.Linear(c.width, c.width)
        self.update = Update(c)
        nn.init.orthogonal_(self.qk.weight, _CROSS_GAIN)
        nn.init.zeros_(self.qk.bias)

    def forward(self, x0, encoding0, x1, encoding1, bias0, bias1
                ) -> tuple[torch.Tensor, torch.Tensor]:
        plain0, plain1 = self.norm(x0), self.norm(x1)
        state0, state1 = plain0 + encoding0, plain1 + encoding1
        qk0, qk1, v0, v1 = (split_heads(t, self.heads) for t in (
            self.qk(plain0), self.qk(plain1), self.v(state0), self.v(state1)))
        message0 = attend(qk0, qk1, v1, bias1)
        message1 = attend(qk1, qk0, v0, bias0)
        return (x0 + self.update(state0, join_heads(message0)),
                x1 + self.update(state1, join_heads(message1)))


def attend(q: torch.Tensor, k: torch.Tensor, v: torch.Tensor, bias: torch.Tensor | None
           ) -> torch.Tensor:
    """Attention (B, heads, N, head); on a CPU trained in half the time of torch's fused one."""
    if q.is_cuda:
        return F.scaled_dot_product_attention(q, k, v, bias)
    logits = (q * q.shape[3] ** -0.5) @ k.transpose(2, 3)
    return F.softmax(logits if bias is None else logits + bias, dim=3) @ v


def split_heads(x: torch.Tensor, heads: int) -> torch.Tensor:
    """(B, N, width) to (B, heads, N, width / heads)."""
    return x.unflatten(2, (heads, -1)).transpose(1, 2)


def join_heads(x: torch.Tensor) -> torch.Tensor:
    """(B, heads, N, head) to (B, N, heads * head)."""
    return x.transpose(1, 2).flatten(2)
