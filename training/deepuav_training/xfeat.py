"""XFeat's key points and descriptors, to compare with.

Potje, Cadar, Araujo, Martins and Nascimento, "XFeat: Accelerated Features for Lightweight Image
Matching", 2024.
"""

from pathlib import Path

import numpy as np
import openvino

from deepuav_training.errors import TrainingError
from deepuav_training.keypoints import (CELL, DetectionConfig, detect, probability_map,
                                        sample_descriptors)
from deepuav_training.runtime import Features

_SIDE = 640  # pixels of the square image that the file is made for
_CANDIDATES = 4096
_THRESHOLD = 0.05  # of the paper's program, as the suppression over 5x5 pixels
_SUPPRESSION_RADIUS = 2
_DESCRIPTOR, _LOGITS, _RELIABILITY = 64, 65, 1  # channels, by which outputs are told apart


class XFeatExtractor:
    """The network without its ending: picks key points as the paper's program does.

    Smaller images are continued by their mirror image to the size that the file takes.
    """

    def __init__(self, model: str | Path, points: int, threads: int, precision: str):
        if not Path(model).is_file():
            raise TrainingError(f"{model}: no such file, expected XFeat's backbone")
        settings = {"INFERENCE_NUM_THREADS": threads, "NUM_STREAMS": 1,
                    "INFERENCE_PRECISION_HINT": precision}
        self._compiled = openvino.Core().compile_model(str(model), "CPU", settings)
        self._points = points

    def __call__(self, image: np.ndarray) -> Features:
        height, width = image.shape
        if max(height, width) > _SIDE:
            raise TrainingError(f"XFeat: found an image of {width}x{height}, expected sides of at "
                                f"most {_SIDE}")
        square = np.pad(image.astype(np.float32) / 255,
                        ((0, _SIDE - height), (0, _SIDE - width)), mode="symmetric")
        found = {value.shape[1]: value[0] for value in
                 self._compiled(np.repeat(square[None, None], 3, axis=1)).values()}
        cells = np.s_[:, : height // CELL, : width // CELL]
        logits, descriptors, reliability = (found[channels][cells] for channels in
                                            (_LOGITS, _DESCRIPTOR, _RELIABILITY))
        detection = DetectionConfig(_CANDIDATES, _THRESHOLD, _SUPPRESSION_RADIUS, subpixel=False)
        points, scores = detect(probability_map(logits), detection)
        column, row = (points / CELL).astype(int).T
        scores = scores * reliability[0, row, column]
        best = np.argsort(-scores, kind="stable")[: self._points]
        return Features(points[best], scores[best], sample_descriptors(descriptors, points[best]),
                        (width, height))
