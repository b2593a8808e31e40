"""Images that show a network to be quantised what it will meet."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from deepuav_training.data.homography import warp_image
from deepuav_training.data.photometric import PhotometricConfig, degrade
from deepuav_training.data.views import load_grey
from deepuav_training.label import LabelConfig, training_views

_SEED = 23


def calibration_images(labels: LabelConfig, count: int, width: int, height: int
                       ) -> list[np.ndarray]:
    """Views of training photographs as (1, 1, H, W) in 0..1, evenly over the sources.

    They are degraded as in training: a network meets dark and noisy images too.
    """
    size = replace(labels.views, count=count, width=width, height=height)
    views = training_views(replace(labels, views=size))
    images = []
    for view in views:
        photo = load_grey(Path(labels.images) / view.photograph.file)
        image, _ = warp_image(photo, view.view_from_photo, width, height)
        degraded = degrade(image, np.random.default_rng([_SEED, view.index]), PhotometricConfig())
        images.append(degraded[None, None].astype(np.float32) / 255)
    return images
