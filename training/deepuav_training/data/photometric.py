"""What light, air, lens and camera do to a picture: random degradations of grey images."""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from deepuav_training.config import check_field


@dataclass(frozen=True)
class PhotometricConfig:
    """Shares of the images that suffer each degradation, and the largest of its strengths."""

    clean_share: float = 0.2  # images left as they are
    light_share: float = 0.9  # exposure, contrast and gamma
    exposure: float = 0.9  # +- natural logarithm of the gain
    contrast: float = 0.5  # +- natural logarithm
    gamma: float = 0.5  # +- natural logarithm
    darkest_mean: float = 0.1  # the exposure's gain takes the mean no further
    brightest_mean: float = 0.7
    shadow_share: float = 0.3
    shadow_depth: float = 0.7  # share of the light that is lost
    haze_share: float = 0.2
    haze: float = 0.6  # share of the light that comes from the air
    rain_share: float = 0.04
    rain_streaks: int = 80
    blur_share: float = 0.25  # half of it motion, half defocus
    motion_px: float = 9.0
    defocus_sigma_px: float = 1.8
    noise_share: float = 0.6
    noise: float = 0.06  # standard deviation, of full scale
    jpeg_share: float = 0.3
    jpeg_quality_min: int = 25

    def check(self, where: str) -> None:
        for name, value in vars(self).items():
            if name.endswith("_share"):
                check_field(0 <= value <= 1, where, name, value, "a share in [0, 1]")
            else:
                check_field(value >= 0, where, name, value, "at least 0")
        check_field(self.jpeg_quality_min <= 100, where, "jpeg_quality_min", self.jpeg_quality_min,
                    "at most 100")


def degrade(image: np.ndarray, rng: np.random.Generator, config: PhotometricConfig) -> np.ndarray:
    """A degraded copy of a grey image (H, W) uint8; the geometry stays."""
    if rng.random() < config.clean_share:
        return image
    picture = image.astype(np.float32) / 255.0
    if rng.random() < config.shadow_share:
        picture = shadow(picture, rng, config.shadow_depth)
    if rng.random() < config.light_share:
        picture = change_light(picture, rng, config)
    if rng.random() < config.haze_share:
        picture = haze(picture, rng, config.haze)
    if rng.random() < config.rain_share:
        picture = rain(picture, rng, config.rain_streaks)
    if rng.random() < config.blur_share:
        picture = blur(picture, rng, config)
    if rng.random() < config.noise_share:
        sigma = config.noise * rng.random() ** 2
        picture = picture + sigma * rng.standard_normal(picture.shape, dtype=np.float32)
    result = np.rint(np.clip(picture, 0, 1) * 255).astype(np.uint8)
    if rng.random() < config.jpeg_share:
        result = jpeg(result, int(rng.integers(config.jpeg_quality_min, 101)))
    return result


def change_light(picture: np.ndarray, rng: np.random.Generator, config: PhotometricConfig
                 ) -> np.ndarray:
    """Gamma, contrast about the mean and exposure, of a picture in 0..1."""
    gamma = math.exp(rng.uniform(-config.gamma, config.gamma))
    contrast = math.exp(rng.uniform(-config.contrast, config.contrast))
    gain = math.exp(rng.uniform(-config.exposure, config.exposure))
    levels = np.linspace(0, 1, 256, dtype=np.float32) ** gamma
    picture = levels[np.clip(picture * 255, 0, 255).astype(np.uint8)]
    mean = float(picture.mean())
    darkest, brightest = (level / max(mean, 1e-3)
                          for level in (config.darkest_mean, config.brightest_mean))
    gain = min(max(gain, min(darkest, 1.0)), max(brightest, 1.0))
    return np.clip((mean + contrast * (picture - mean)) * gain, 0, 1).astype(np.float32)


def shadow(picture: np.ndarray, rng: np.random.Generator, depth: float) -> np.ndarray:
    """Darkens a random polygon with a soft or sharp edge."""
    height, width = picture.shape
    centre = rng.uniform(0, 1, 2) * (width, height)
    angles = np.sort(rng.uniform(0, 2 * math.pi, rng.integers(3, 8)))
    radii = rng.uniform(0.15, 0.7, len(angles)) * max(width, height)
    corners = centre + radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    mask = np.zeros(picture.shape, np.float32)
    cv2.fillPoly(mask, [np.rint(corners).astype(np.int32)], 1.0)
    mask = cv2.GaussianBlur(mask, (0, 0), rng.uniform(0.5, 6.0))
    return picture * (1 - rng.uniform(0.2, 1.0) * depth * mask)


def haze(picture: np.ndarray, rng: np.random.Generator, strength: float) -> np.ndarray:
    """Mixes in light of the air, more towards one side of the picture."""
    height, width = picture.shape
    angle, amount = rng.uniform(0, 2 * math.pi), rng.uniform(0.1, 1.0) * strength
    x = np.linspace(-0.5, 0.5, width, dtype=np.float32) * math.cos(angle)
    y = np.linspace(-0.5, 0.5, height, dtype=np.float32) * math.sin(angle)
    share = np.clip(amount * (0.7 + 0.6 * (y[:, None] + x[None, :])), 0, 1)
    return (picture * (1 - share) + rng.uniform(0.5, 0.95) * share).astype(np.float32)


def rain(picture: np.ndarray, rng: np.random.Generator, streaks: int) -> np.ndarray:
    """Bright parallel streaks."""
    height, width = picture.shape
    layer = np.zeros(picture.shape, np.float32)
    angle, length = rng.normal(math.pi / 2, 0.2), rng.uniform(6, 24)
    step = length * np.array([math.cos(angle), math.sin(angle)])
    for start in rng.uniform(0, 1, (rng.integers(streaks // 4, streaks + 1), 2)) * (width, height):
        ends = np.rint(np.stack([start, start + step])).astype(int)
        cv2.line(layer, ends[0].tolist(), ends[1].tolist(), float(rng.uniform(0.1, 0.4)))
    return picture + cv2.GaussianBlur(layer, (3, 3), 0)


def blur(picture: np.ndarray, rng: np.random.Generator, config: PhotometricConfig) -> np.ndarray:
    """Motion along a line, or defocus; both leave points where they are on average."""
    if rng.random() < 0.5:
        return cv2.GaussianBlur(picture, (0, 0), rng.uniform(0.3, config.defocus_sigma_px))
    return cv2.filter2D(picture, -1, motion_kernel(rng.uniform(1, max(1.0, config.motion_px)),
                                                   rng.uniform(0, math.pi)))


def motion_kernel(length_px: float, angle_rad: float) -> np.ndarray:
    """A symmetric kernel of sum 1 along a line through its centre."""
    reach = int(math.ceil(length_px / 2)) + 1
    kernel = np.zeros((2 * reach + 1, 2 * reach + 1), np.float32)
    along = np.linspace(-0.5, 0.5, 8 * reach + 1) * length_px
    x, y = along * math.cos(angle_rad) + reach, along * math.sin(angle_rad) + reach
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    for dx in (0, 1):
        for dy in (0, 1):
            weight = (1 - np.abs(x - left - dx)) * (1 - np.abs(y - top - dy))
            np.add.at(kernel, (top + dy, left + dx), weight.astype(np.float32))
    return kernel / kernel.sum()


def jpeg(image: np.ndarray, quality: int) -> np.ndarray:
    """What JPEG leaves of an image (H, W) uint8."""
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)
