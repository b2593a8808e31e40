"""Stage 1: teacher labels for the views of all training photographs.

    python -m deepuav_training.label --config configs/labels.yaml

Labels that exist are kept, so the command can be stopped and started again at any time. `--part 1/2` beside `--part 2/2`
makes use of two cores.
"""

import argparse
import dataclasses
import logging
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from deepuav_training.adaptation import AdaptationConfig, adapt
from deepuav_training.cache_identity import claim, file_digest, photographs_identity
from deepuav_training.config import check_field, load_config
from deepuav_training.data.homography import warp_image
from deepuav_training.data.manifest import SplitConfig, read_manifest, split_photographs
from deepuav_training.data.views import View, ViewConfig, list_views, load_grey
from deepuav_training.errors import telling_errors
from deepuav_training.label_cache import label_path, save_labels
from deepuav_training.runtime import Network

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class LabelConfig:
    """What is labelled, by whom and where the labels go."""

    images: str = "../../shared/images"  # folder with MANIFEST.tsv
    teacher: str = "../../shared/models/superpoint_coco.onnx"
    cache: str = "cache/labels"
    threads: int = 1
    precision: str = "bf16"
    seed: int = 7
    split: SplitConfig = field(default_factory=SplitConfig)
    views: ViewConfig = field(default_factory=ViewConfig)
    adaptation: AdaptationConfig = field(default_factory=AdaptationConfig)


def training_views(config: LabelConfig) -> list[View]:
    """The views of the training photographs, in the order in which they are labelled."""
    training, _ = split_photographs(read_manifest(config.images), config.split)
    return list_views(training, config.views, config.images)


def label_identity(config: LabelConfig) -> dict:
    """What decides which view a number stands for."""
    views = dataclasses.asdict(config.views)
    del views["count"]  # more are added behind
    return photographs_identity(config.images, config.split) | {"views": views}


def part_of(views: list[View], part: str) -> list[View]:
    """Of the views, every n-th from the k-th on, where `part` is "k/n"."""
    numbers = part.split("/")
    expected = "k/n with 1 <= k <= n"
    check_field(len(numbers) == 2 and all(text.isdecimal() for text in numbers), "command line",
                "--part", part, expected)
    k, n = map(int, numbers)
    check_field(1 <= k <= n, "command line", "--part", part, expected)
    return views[k - 1 :: n]


def label_views(config: LabelConfig, views: list[View]) -> int:
    """Labels the views that have no labels yet; returns how many were labelled."""
    claim(config.cache, label_identity(config) | {
        "teacher": file_digest(config.teacher),
        "adaptation": dataclasses.asdict(config.adaptation), "seed": config.seed})
    teacher = Network(config.teacher, config.threads, config.precision)
    start, done = time.monotonic(), 0
    for view in views:
        path = label_path(config.cache, view.index)
        if path.exists():
            continue
        photo = load_grey(Path(config.images) / view.photograph.file)
        image, _ = warp_image(photo, view.view_from_photo, config.views.width,
                              config.views.height)
        rng = np.random.default_rng([config.seed, view.index])
        labels = adapt(image, teacher, config.adaptation, rng)
        save_labels(path, labels)
        done += 1
        if done % 50 == 0:
            _LOG.info("view %d of %d, %.2f s a view, %d points in the last", view.index + 1,
                      len(views), (time.monotonic() - start) / done, len(labels.points))
    return done


@telling_errors
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--config", required=True)
    parser.add_argument("--part", default="1/1", metavar="K/N",
                        help="every N-th view from the K-th on (%(default)s: all)")
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(message)s")
    config = load_config(LabelConfig, arguments.config)
    count = label_views(config, part_of(training_views(config), arguments.part))
    _LOG.info("%d views labelled in %s", count, config.cache)


if __name__ == "__main__":
    main()
