"""Stage 4, first part: scenes with true correspondences, and a network's features of their views.

    python -m deepuav_training.cache_scenes --config configs/scenes.yaml

Scenes that exist are kept, so the command can be stopped and started again at any time. `--part 1/2`
beside `--part 2/2` makes use of two cores.
"""

import argparse
import dataclasses
import functools
import logging
import time
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from deepuav_training.cache_identity import claim, file_digest, photographs_identity
from deepuav_training.config import check_field, load_config
from deepuav_training.data.manifest import Photograph, read_manifest, split_photographs
from deepuav_training.data.scenes import Scene, SceneConfig, make_scene
from deepuav_training.data.terrain import read_height_maps
from deepuav_training.data.views import load_grey
from deepuav_training.errors import telling_errors
from deepuav_training.keypoints import DetectionConfig
from deepuav_training.label import LabelConfig, part_of
from deepuav_training.runtime import Network
from deepuav_training.scene_cache import extract_scene, save_scene, scene_path

_LOG = logging.getLogger(__name__)
_ATTEMPTS = 20  # at a scene whose views all have enough key points


@dataclass(frozen=True)
class SceneSourceConfig:
    """What scenes are drawn from."""

    labels: str = "configs/labels.yaml"  # names the photographs and the places held out
    heights: str = "dem"  # folder of height maps among the photographs' folders
    seed: int = 21
    scene: SceneConfig = field(default_factory=SceneConfig)


@dataclass(frozen=True)
class CacheConfig(SceneSourceConfig):
    """What is rendered, whose features are kept and where."""

    networks: tuple = ("../models/superpoint_small.onnx",)  # of one descriptor space; by turns
    cache: str = "cache/scenes"
    count: int = 4000  # scenes
    threads: int = 1
    precision: str = "bf16"
    # No threshold: every view gives the same number of key points, good and bad ones.
    detection: DetectionConfig = field(
        default_factory=lambda: DetectionConfig(max_points=512, threshold=0.0))

    def check(self, where: str) -> None:
        check_field(self.count > 0, where, "count", self.count, "at least 1")
        check_field(len(self.networks) > 0, where, "networks", self.networks, "at least one file")


class SceneSource:
    """Draws scenes of the training photographs; a scene depends on the seed and its index alone."""

    def __init__(self, config: SceneSourceConfig):
        labels = load_config(LabelConfig, config.labels)
        training, _ = split_photographs(read_manifest(labels.images), labels.split)
        self._config = config
        self._photographs = by_turns(training, config.seed)
        self._maps = read_height_maps(Path(labels.images) / config.heights)
        self._photo = functools.lru_cache(maxsize=256)(
            lambda file: load_grey(Path(labels.images) / file))

    def draw(self, index: int, attempt: int) -> Scene:
        """One of several scenes of this index."""
        rng = np.random.default_rng([self._config.seed, index, attempt])
        photographs = self._photographs
        photo = photographs[index % len(photographs)]
        paint = photographs[rng.integers(len(photographs))]
        return make_scene(self._photo(photo.file), self._photo(paint.file), self._maps, rng,
                          self._config.scene)


def scene_identity(config: CacheConfig) -> dict:
    """What decides over a scene of a number."""
    labels = load_config(LabelConfig, config.labels)
    return photographs_identity(labels.images, labels.split) | {
        "seed": config.seed, "scene": dataclasses.asdict(config.scene),
        "detection": dataclasses.asdict(config.detection)}


def by_turns(photographs: list[Photograph], seed: int) -> list[Photograph]:
    """An order in which the sources take turns, short ones from the start again."""
    rng = np.random.default_rng(seed)
    by_source = {}
    for photo in photographs:
        by_source.setdefault(photo.source, []).append(photo)
    queues = [[photos[i] for i in rng.permutation(len(photos))]
              for _, photos in sorted(by_source.items())]
    return [queue[turn % len(queue)] for turn in range(max(map(len, queues))) for queue in queues]


def cache_scenes(config: CacheConfig, numbers: list[int]) -> int:
    """Makes those scenes that do not exist yet; returns how many were made."""
    claim(config.cache, scene_identity(config) | {
        "networks": [file_digest(file) for file in config.networks]})
    source = SceneSource(config)
    networks = [Network(file, config.threads, config.precision) for file in config.networks]
    start, done = time.monotonic(), 0
    for index in numbers:
        path = scene_path(config.cache, index)
        if path.exists():
            continue
        for attempt in range(_ATTEMPTS):
            found = extract_scene(source.draw(index, attempt), networks[index % len(networks)],
                                  config.detection)
            if found is not None:
                save_scene(path, found)
                break
        done += 1
        if done % 20 == 0:
            _LOG.info("scene %d of %d, %.2f s a scene", index + 1, config.count,
                      (time.monotonic() - start) / done)
    return done


@telling_errors
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--config", required=True)
    parser.add_argument("--part", default="1/1", metavar="K/N",
                        help="every N-th scene from the K-th on (%(default)s: all)")
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    config = load_config(CacheConfig, arguments.config)
    cv2.setNumThreads(config.threads)
    count = cache_scenes(config, part_of(list(range(config.count)), arguments.part))
    _LOG.info("%d scenes made in %s", count, config.cache)


if __name__ == "__main__":
    main()
