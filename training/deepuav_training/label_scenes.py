"""Stage 1 for scenes: rendered views with true depth, and the teacher's labels of each view.

    python -m deepuav_training.label_scenes --config configs/labelled_scenes.yaml

Scenes that exist are kept, so the command can be stopped and started again at any time. `--part 1/2` beside `--part 2/2`
makes use of two cores.
"""

import argparse
import dataclasses
import logging
import time
from dataclasses import dataclass, field

import cv2
import numpy as np

from deepuav_training.adaptation import AdaptationConfig, Teacher, adapt
from deepuav_training.cache_identity import claim, file_digest, photographs_identity
from deepuav_training.cache_scenes import SceneSource, SceneSourceConfig
from deepuav_training.config import check_field, load_config
from deepuav_training.data.photometric import PhotometricConfig
from deepuav_training.data.scenes import Scene, SceneConfig
from deepuav_training.errors import telling_errors
from deepuav_training.label import LabelConfig, part_of
from deepuav_training.labelled_scenes import LabelledScene, relate, save_labelled_scene
from deepuav_training.runtime import Network
from deepuav_training.scene_cache import scene_path

_LOG = logging.getLogger(__name__)
_ATTEMPTS = 20  # at a scene with views that show the same points
_CLEAN = SceneConfig(views=5, width=320, height=240, flat_share=0.0, room_share=0.6,
                     photometric=PhotometricConfig(clean_share=1.0))


@dataclass(frozen=True)
class LabelScenesConfig(SceneSourceConfig):
    """What is rendered, who labels it and where it is kept."""

    teacher: str = "../models/superpoint_large.onnx"
    cache: str = "cache/labelled_scenes"
    count: int = 4000  # scenes
    threads: int = 1
    precision: str = "f32"
    least_shared: int = 48  # points of a view that another one must show, in at least one pair
    scene: SceneConfig = _CLEAN
    adaptation: AdaptationConfig = field(default_factory=AdaptationConfig)

    def check(self, where: str) -> None:
        check_field(self.count > 0, where, "count", self.count, "at least 1")
        check_field(self.least_shared > 0, where, "least_shared", self.least_shared, "at least 1")
        check_field(self.scene.photometric.clean_share == 1, where, "scene.photometric.clean_share",
                    self.scene.photometric.clean_share, "1: views are degraded when they are drawn")


def labelled_identity(config: LabelScenesConfig) -> dict:
    """What decides over the scene of a number."""
    labels = load_config(LabelConfig, config.labels)
    return photographs_identity(labels.images, labels.split) | {
        "seed": config.seed, "scene": dataclasses.asdict(config.scene), "heights": config.heights,
        "least_shared": config.least_shared}


def label_scene(scene: Scene, teacher: Teacher, config: LabelScenesConfig,
                rng: np.random.Generator) -> LabelledScene | None:
    """Labels all views, or gives None if no two of them show enough of the same points, or one has
    none."""
    labels = [adapt(image, teacher, config.adaptation, rng) for image in scene.images]
    if min(len(view.points) for view in labels) == 0:
        return None
    labelled = relate(scene, labels, config.adaptation.border)
    return labelled if labelled.counts().max() >= config.least_shared else None


def label_scenes(config: LabelScenesConfig, numbers: list[int]) -> int:
    """Makes those scenes that do not exist yet; returns how many were made."""
    claim(config.cache, labelled_identity(config) | {
        "adaptation": dataclasses.asdict(config.adaptation), "teacher": file_digest(config.teacher)})
    source, teacher = SceneSource(config), Network(config.teacher, config.threads, config.precision)
    start, done = time.monotonic(), 0
    for index in numbers:
        path = scene_path(config.cache, index)
        if path.exists():
            continue
        for attempt in range(_ATTEMPTS):
            rng = np.random.default_rng([config.seed, index, attempt, 1])
            found = label_scene(source.draw(index, attempt), teacher, config, rng)
            if found is not None:
                save_labelled_scene(path, found)
                break
        else:
            _LOG.warning("scene %d: no two views show enough of the same points", index + 1)
            continue
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
    config = load_config(LabelScenesConfig, arguments.config)
    cv2.setNumThreads(config.threads)
    count = label_scenes(config, part_of(list(range(config.count)), arguments.part))
    _LOG.info("%d scenes labelled in %s", count, config.cache)


if __name__ == "__main__":
    main()
