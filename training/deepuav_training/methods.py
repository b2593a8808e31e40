"""Methods that are compared: what finds key points in two images, and what matches them."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deepuav_training.classic import OrbExtractor, SiftExtractor, hamming_nearest, ratio_nearest
from deepuav_training.config import check_field
from deepuav_training.keypoints import DetectionConfig
from deepuav_training.learned_matchers import LighterGlueMatcher, SuperGlueMatcher
from deepuav_training.metrics import mutual_nearest
from deepuav_training.runtime import Features, Network, extract
from deepuav_training.xfeat import XFeatExtractor

Extractor = Callable[[np.ndarray], Features]  # grey image (H, W) uint8, sides multiples of 8
Matcher = Callable[[Features, Features], np.ndarray]  # rows (M, 2) of both


@dataclass(frozen=True)
class Method:
    """Extractors of the first and of the second image, and a matcher."""

    name: str
    extract_a: Extractor
    extract_b: Extractor
    match: Matcher


@dataclass(frozen=True)
class MethodConfig:
    """A method by names and files."""

    name: str
    extractor: str = "superpoint"  # or sift, orb, xfeat
    model: str = ""  # the extractor's network
    second_model: str = ""  # the second image's, if another
    matcher: str = "nearest"  # or ratio, superglue, lighterglue
    matcher_model: str = ""
    min_score: float = 0.2  # least score of superglue's or lighterglue's matches

    def check(self, where: str) -> None:
        check_field(self.extractor in ("superpoint", "sift", "orb", "xfeat"), where, "extractor",
                    self.extractor, "superpoint, sift, orb or xfeat")
        check_field(self.matcher in ("nearest", "ratio", "superglue", "lighterglue"), where,
                    "matcher", self.matcher, "nearest, ratio, superglue or lighterglue")
        check_field(0 <= self.min_score < 1, where, "min_score", self.min_score, "0 to below 1")


@dataclass(frozen=True)
class MethodOptions:
    """What all methods share."""

    points: int = 1024  # of an image, at most
    threshold: float = 0.005  # least probability of a SuperPoint's key points
    precision: str = "f32"  # of networks
    threads: int = 1
    # Networks' extractors by kind and file, shared by methods of other options; None: not shared.
    shared: dict | None = None
    most_points: int = 1024  # that any method of the shared extractors takes
    faint_points: int = 450  # where fewer have it, as many are taken, as the program does...
    faint_threshold: float = 0.001  # ...of at least this probability


def build_method(config: MethodConfig, options: MethodOptions) -> Method:
    """Loads what a method needs."""
    first = _extractor(config.extractor, config.model, options)
    second = (_extractor(config.extractor, config.second_model, options) if config.second_model
              else first)
    return Method(config.name, first, second, _matcher(config, options))


def nearest_methods(models: list[str], superglue: list[str], min_score: float,
                    options: MethodOptions) -> list[Method]:
    """SuperPoints FILE or FILE+FILE with nearest neighbours and with each of the matchers."""
    methods = []
    for text in models:
        first, _, second = text.partition("+")
        name = " + ".join(Path(file).stem for file in text.split("+"))
        methods.append(MethodConfig(name, "superpoint", first, second))
        methods += [MethodConfig(f"{name}, {Path(file).stem}", "superpoint", first, second,
                                 "superglue", file, min_score) for file in superglue]
    return [build_method(config, options) for config in methods]


class RememberedExtractor:
    """Extracts from each image once: fewer key points are the best of more."""

    def __init__(self, extractor: Extractor):
        self._extractor = extractor
        self._found: dict[bytes, Features] = {}

    def best(self, points: int) -> Extractor:
        """An extractor of at most that many key points."""
        return lambda image: _first(self._features(image), points)

    def _features(self, image: np.ndarray) -> Features:
        key = hashlib.blake2b(image.tobytes() + str(image.shape).encode()).digest()
        if key not in self._found:
            self._found[key] = self._extractor(image)
        return self._found[key]


def without_faint(features: Features, options: MethodOptions) -> Features:
    """Only the key points above the threshold, but no fewer than the faint ones that are allowed."""
    clear = int(np.count_nonzero(features.scores > options.threshold))
    return _first(features, max(clear, options.faint_points))


def _first(features: Features, points: int) -> Features:
    return Features(features.points[:points], features.scores[:points],
                    features.descriptors[:points], features.size)


def _extractor(kind: str, model: str, options: MethodOptions) -> Extractor:
    if kind == "sift":
        return SiftExtractor(options.points)
    if kind == "orb":
        return OrbExtractor(options.points)
    if options.shared is None:
        return _network_extractor(kind, model, options.points, options)
    if (kind, model) not in options.shared:
        options.shared[kind, model] = RememberedExtractor(
            _network_extractor(kind, model, options.most_points, options))
    return options.shared[kind, model].best(options.points)


def _network_extractor(kind: str, model: str, points: int, options: MethodOptions) -> Extractor:
    if kind == "xfeat":
        return XFeatExtractor(model, points, options.threads, options.precision)
    network = Network(model, options.threads, options.precision)
    detection = DetectionConfig(max_points=points,
                                threshold=min(options.threshold, options.faint_threshold))
    return lambda image: without_faint(extract(network, image, detection), options)


def _matcher(config: MethodConfig, options: MethodOptions) -> Matcher:
    if config.matcher == "superglue":
        return SuperGlueMatcher(config.matcher_model, options.threads, options.precision,
                                config.min_score)
    if config.matcher == "lighterglue":
        return LighterGlueMatcher(config.matcher_model, options.threads, options.precision,
                                  config.min_score)
    if config.matcher == "ratio":
        return ratio_nearest
    if config.extractor == "orb":
        return hamming_nearest
    return lambda a, b: mutual_nearest(a.descriptors, b.descriptors)
