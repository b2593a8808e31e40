import cv2
import numpy as np

from deepuav_training.calibration import calibration_images
from deepuav_training.config import from_mapping
from deepuav_training.label import LabelConfig

# The training photographs are darker than the held-out ones, whatever is done to them.
_TRAINING, _HELD_OUT = ("field", "town"), ("coast",)


def photographs(folder):
    """Two of each place, all of them plain."""
    (folder / "aerial").mkdir()
    rows = ["file\tsource_repo\toriginal_path"]
    for place in _TRAINING + _HELD_OUT:
        for number in range(2):
            name = f"aerial/{place}_{number}.png"
            grey = 255 if place in _HELD_OUT else 30
            cv2.imwrite(str(folder / name), np.full((120, 160), grey, np.uint8))
            rows.append(f"{name}\tsomewhere\t{place}/{number}")
    (folder / "MANIFEST.tsv").write_text("\n".join(rows) + "\n")
    return from_mapping(LabelConfig, {"images": str(folder),
                                      "split": {"validation_places": list(_HELD_OUT)}}, "test")


def test_calibration_images_are_views_of_training_places(tmp_path):
    images = calibration_images(photographs(tmp_path), 12, 64, 48)
    assert len(images) == 12
    for image in images:
        assert image.shape == (1, 1, 48, 64) and image.dtype == np.float32
        assert 0 <= image.min() and image.max() <= 1
        assert np.median(image) < 0.8  # a held-out one is white
    assert len({round(float(image.mean()), 4) for image in images}) > 6  # they are degraded


def test_calibration_images_come_out_the_same(tmp_path):
    labels = photographs(tmp_path)
    first, second = (calibration_images(labels, 5, 64, 48) for _ in range(2))
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))
