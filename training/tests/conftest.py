from functools import partial

import cv2
import pytest
import torch
from superglue_support import CONFIG, tiny_scene

from deepuav_training.data.matches import MatchSource
from deepuav_training.scene_cache import cached_scenes, save_scene, scene_path

# The networks of the tests are tiny: more threads only wait for one another.
torch.set_num_threads(1)
cv2.setNumThreads(1)


@pytest.fixture(name="source")
def tiny_source(tmp_path):
    for index in range(3):
        save_scene(scene_path(tmp_path / "scenes", index), tiny_scene(index))
    return MatchSource(partial(cached_scenes, tmp_path / "scenes", 5, "cache_scenes"),
                       CONFIG.matches, seed=1)
