"""What tests of matchers share: a tiny network, scenes for it and its inputs."""

import numpy as np
import torch

from deepuav_training.data.matches import MatchConfig
from deepuav_training.export_superglue import random_inputs
from deepuav_training.models.superglue import SuperGlue, SuperGlueConfig
from deepuav_training.scene_cache import SceneFeatures
from deepuav_training.train_superglue import GlueTrainConfig

TINY = SuperGlueConfig(descriptor=32, width=16, heads=2, layers=2, hidden=16)
CONFIG = GlueTrainConfig(network=TINY, batch=4, bfloat16=False, steps=40, learning_rate=0.003,
                         matches=MatchConfig(points=12, least_matches=1))


def tiny_scene(seed, views=3, count=16):
    """The same points in every view; their descriptors differ by noise, those of half are alike."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(10, 90, (views, count, 2)).astype(np.float32)
    clean = rng.standard_normal((count, TINY.descriptor))
    clean[: count // 2] = clean[0]
    noisy = clean + 0.3 * rng.standard_normal((views, *clean.shape))
    descriptors = noisy / np.linalg.norm(noisy, axis=2, keepdims=True)
    seen_at = np.tile(points[None], (views, 1, 1, 1))
    seen_at[:, :, :2] = np.nan  # two that no other view shows
    return SceneFeatures(points, rng.uniform(0, 1, (views, count)).astype(np.float32),
                         descriptors.astype(np.float32), seen_at, np.array([100, 100], np.int32))


def torch_inputs(counts, seed=0):
    return list(map(torch.from_numpy, random_inputs(counts, TINY.descriptor, seed)))


def trained_network():
    torch.manual_seed(1)
    network = SuperGlue(TINY)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(0.2 * torch.randn(parameter.shape))
    return network
