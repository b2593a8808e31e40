"""Matchers that are networks, run with OpenVINO: the project's own, and one to compare with."""

from pathlib import Path

import numpy as np
import openvino

from deepuav_training.data.matches import normalise
from deepuav_training.errors import TrainingError
from deepuav_training.runtime import Features

_NO_MATCH = np.zeros((0, 2), np.int64)


class SuperGlueMatcher:
    """An exported SuperGlue: pairs whose probability is the largest of its row and its column."""

    def __init__(self, model: str | Path, threads: int, precision: str, min_score: float):
        """`min_score` is the least assignment probability of a match."""
        self._compiled = _compile(model, threads, precision)
        self._min_score = min_score

    def __call__(self, a: Features, b: Features) -> np.ndarray:
        """Rows (M, 2) of both."""
        if len(a.points) == 0 or len(b.points) == 0:
            return _NO_MATCH
        inputs = {}
        for side, view in enumerate((a, b)):
            inputs |= {f"keypoints{side}": normalise(view.points, view.size)[None],
                       f"scores{side}": view.scores[None],
                       f"descriptors{side}": view.descriptors[None]}
        return mutual_best(self._compiled(inputs)["log_assignment"][0], self._min_score)


def mutual_best(log_assignment: np.ndarray, min_score: float) -> np.ndarray:
    """Rows and columns (M, 2) of the maxima of both, of at least that probability."""
    best1, best0 = log_assignment.argmax(axis=1), log_assignment.argmax(axis=0)
    rows = np.arange(len(best1))
    kept = (best0[best1] == rows) & (log_assignment[rows, best1] >= np.log(min_score))
    return np.stack([rows[kept], best1[kept]], axis=1)


class LighterGlueMatcher:
    """LighterGlue, for XFeat's descriptors."""

    def __init__(self, model: str | Path, threads: int, precision: str, min_score: float):
        """`min_score` is the least score of a match; its authors' program takes 0.1."""
        self._compiled = _compile(model, threads, precision)
        self._min_score = min_score

    def __call__(self, a: Features, b: Features) -> np.ndarray:
        """Rows (M, 2) of both."""
        if len(a.points) == 0 or len(b.points) == 0:
            return _NO_MATCH
        found = self._compiled({"kpts0": normalise(a.points, a.size)[None],
                                "kpts1": normalise(b.points, b.size)[None],
                                "desc0": a.descriptors[None], "desc1": b.descriptors[None]})
        matches = np.asarray(found["matches"], np.int64).reshape(-1, 2)
        return matches[np.asarray(found["scores"]).ravel() >= self._min_score]


def _compile(model: str | Path, threads: int, precision: str) -> openvino.CompiledModel:
    if not Path(model).is_file():
        raise TrainingError(f"{model}: no such file, expected a matcher's network")
    settings = {"INFERENCE_NUM_THREADS": threads, "NUM_STREAMS": 1,
                "INFERENCE_PRECISION_HINT": precision}
    return openvino.Core().compile_model(str(model), "CPU", settings)
