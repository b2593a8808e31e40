"""What other precisions change of a network, on photographs of held-out places.

    python -m deepuav_training.compare_precisions ../models/superpoint_small.onnx \\
        ../models/superpoint_small_int8.onnx --labels configs/labels.yaml

Finer than what `evaluate` tells: which layers may be quantised is decided by this. Both see the same
image, so that nothing but rounding moves a key point.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deepuav_training.config import load_config
from deepuav_training.data.photometric import PhotometricConfig, degrade
from deepuav_training.data.views import load_grey
from deepuav_training.errors import telling_errors
from deepuav_training.evaluate import held_out
from deepuav_training.keypoints import CELL, DetectionConfig
from deepuav_training.label import LabelConfig
from deepuav_training.runtime import Features, Network, extract

_SAME_PX = 2.0  # the same key point, at most so far away
_SEED = 29


@dataclass(frozen=True)
class Change:
    """Of one image, or the mean of several."""

    found: float  # share of the reference's key points that are found again
    moved_px: float  # root mean square distance of those
    unlike: float  # mean of 1 - cosine between their descriptors, each read where its point is


def change(reference: Features, other: Features) -> Change:
    """How the other's key points differ from the reference's; NaN where there is nothing to tell."""
    if len(reference.points) == 0:
        return Change(np.nan, np.nan, np.nan)
    if len(other.points) == 0:
        return Change(0.0, np.nan, np.nan)
    apart = np.linalg.norm(reference.points[:, None] - other.points[None], axis=2)
    nearest, distances = apart.argmin(axis=1), apart.min(axis=1)
    same = distances <= _SAME_PX
    if not same.any():
        return Change(0.0, np.nan, np.nan)
    cosines = np.sum(reference.descriptors[same] * other.descriptors[nearest[same]], axis=1)
    return Change(float(same.mean()), float(np.sqrt(np.mean(distances[same] ** 2))),
                  float(np.mean(1 - cosines)))


def mean_change(changes: list[Change]) -> Change:
    """Of images, those left out that have nothing to tell."""
    return Change(*(float(np.nanmean([getattr(c, name) for c in changes]))
                    for name in ("found", "moved_px", "unlike")))


def degraded_photographs(labels: LabelConfig, count: int) -> list[np.ndarray]:
    """Photographs of held-out places with sides of whole cells, degraded as in training."""
    images = []
    for index, photo in enumerate(held_out(labels, count, _SEED)):
        image = load_grey(Path(labels.images) / photo.file)
        height, width = (side // CELL * CELL for side in image.shape)
        rng = np.random.default_rng([_SEED, index])
        images.append(degrade(np.ascontiguousarray(image[:height, :width]), rng,
                              PhotometricConfig()))
    return images


@telling_errors
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("reference", type=Path, help="SuperPoint as ONNX")
    parser.add_argument("others", type=Path, nargs="+", help="the same in another precision")
    parser.add_argument("--labels", required=True, help="configuration that says which places are "
                        "held out")
    parser.add_argument("--images", type=int, default=100, help="photographs (%(default)s)")
    parser.add_argument("--points", type=int, default=1024, help="key points (%(default)s)")
    parser.add_argument("--threads", type=int, default=1, help="of a network (%(default)s)")
    parser.add_argument("--precision", choices=("f32", "bf16"), default="f32", help="that the "
                        "others' float layers are computed in (%(default)s)")
    arguments = parser.parse_args()
    if arguments.images < 1:
        parser.error(f"--images is {arguments.images}, expected at least 1")
    detection = DetectionConfig(max_points=arguments.points)
    images = degraded_photographs(load_config(LabelConfig, arguments.labels), arguments.images)
    reference = Network(arguments.reference, arguments.threads)
    expected = [extract(reference, image, detection) for image in images]
    print("| | found again, % | moved, px rms | descriptors, 1 - cosine |\n|---|---|---|---|")
    for path in arguments.others:
        network = Network(path, arguments.threads, arguments.precision)
        mean = mean_change([change(features, extract(network, image, detection))
                            for features, image in zip(expected, images, strict=True)])
        print(f"| {path.stem} | {100 * mean.found:.1f} | {mean.moved_px:.3f} | {mean.unlike:.5f} |",
              flush=True)


if __name__ == "__main__":
    main()
