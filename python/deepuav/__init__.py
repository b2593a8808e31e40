"""Deep-UAV SLAM: monocular SLAM for drones with learned features.

Poses are 4x4 matrices ``world_from_camera``; the camera looks along z, x right, y down. Lengths are metres where a map is
metric or georeferenced, else the map's own unit. Times are integer nanoseconds of one clock. Pixel (0, 0) is the centre
of the top-left pixel. What goes wrong raises :class:`Error`. The interpreter's lock is released while the library works.
"""
from __future__ import annotations

import functools
import os
from typing import Any, Callable, NamedTuple, Sequence, Union

import numpy as np

from deepuav._deepuav import (Camera, Error, Evaluation, ImuSensor, Map, MapInfo, Matcher, Options, Result, Slam,
                              Statistics, evaluate_files, evaluate_poses, log_to_stderr, run_dataset, version)

__version__ = version()
__all__ = ["Camera", "Error", "Evaluation", "ImuSensor", "Map", "MapInfo", "Matcher", "Matches", "Options", "Result",
           "Slam", "Statistics", "evaluate", "log_to_stderr", "match", "options", "run"]

Path = Union[str, "os.PathLike[str]"]
Image = Union[Path, np.ndarray]
Poses = Union[Path, Result, Map, "tuple[np.ndarray, np.ndarray]"]
Watch = Union[Callable[["dict[str, Any]"], Any], None]


class Matches(NamedTuple):
    """Points that two images have in common, the surest first: row i of ``a`` shows what row i of ``b`` does."""

    a: np.ndarray  #: (n, 2) pixels, x right and y down.
    b: np.ndarray  #: (n, 2)
    score: np.ndarray  #: (n,), 0 to 1.


def options(**values: Any) -> Options:
    """Options of a run under the names of ``deepuav run --set``, with ``__`` for the dot: ``features__keypoints=800``."""
    result = Options()
    for name, value in values.items():
        text = str(value).lower() if isinstance(value, bool) else str(value)
        result.set(name.replace("__", "."), text)
    return result


def run(dataset: Path, out: Path | None = None, *, camera: Path = "", map: Path = "", schedule: str = "threaded",
        use: str = "auto", start: int = 0, end: int = -1, stride: int = 1, on_frame: Watch = None, on_keyframe: Watch = None,
        on_map: Watch = None, on_restart: Callable[[], Any] | None = None, on_dropped: Callable[[int], Any] | None = None,
        **values: Any) -> Result:
    """SLAM over a dataset, a folder of photographs or a video: the same bytes as ``deepuav run``.

    ``out``: folder for the files that the command writes, made if absent. ``values``: as of :func:`options`; the other
    arguments are the command's. ``on_frame``, ``on_keyframe``, ``on_map`` and ``on_dropped`` are told what :class:`Slam`
    tells; ``on_restart`` that all this is void, as the run begins anew. Raises :class:`Error` for what cannot be read, and
    after writing for a run that broke off. Ctrl-C ends it within seconds by ``KeyboardInterrupt``, after writing what there is.
    """
    result = run_dataset(os.fspath(dataset), os.fspath(camera), os.fspath(map), schedule, use, start, end, stride,
                         options(**values), "" if out is None else os.fspath(out), on_frame, on_keyframe, on_map,
                         on_restart, on_dropped)
    if out is not None:
        result.write(os.fspath(out))
    if result.failure:
        raise Error(result.failure)
    return result


@functools.lru_cache(maxsize=4)
def _matcher(max_side_px: int, headings: bool, refine: bool, values: Sequence[tuple[str, Any]]) -> Matcher:
    return Matcher(options(**dict(values)), max_side_px, headings, refine)


def match(a: Image, b: Image, *, max_side_px: int = 640, headings: bool = False, refine: bool = True,
          **values: Any) -> Matches:
    """The points that two images (files, or arrays of grey or RGB bytes) have in common, as ``deepuav match``.

    Several threads may call it at once; pairs of the same options are matched one after the other.
    """
    matcher = _matcher(max_side_px, headings, refine, tuple(sorted(values.items())))
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        table = matcher.match(a, b)
    elif isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        raise Error("two images: expected two arrays or two files")
    else:
        table = matcher.match_files(os.fspath(a), os.fspath(b))
    return Matches(table[:, 0:2], table[:, 2:4], table[:, 4])


def _poses(of: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times and poses by growing time."""
    if isinstance(of, Result):
        frames = of.frames
        known = frames["map"] == of.main_map
        return frames["time_ns"][known], frames["world_from_camera"][known]
    if isinstance(of, Map):
        order = np.argsort(of.keyframes["time_ns"])
        return of.keyframes["time_ns"][order], of.keyframes["world_from_camera"][order]
    times, poses = of
    return np.ascontiguousarray(times, np.int64), np.ascontiguousarray(poses, np.float64)


def evaluate(truth: Poses, estimate: Poses, align: str = "sim3", *, max_difference_s: float = 0.01,
             time_offset_s: float = 0.0, rpe_delta: float = 1.0, rpe_unit: str = "frames") -> Evaluation:
    """Compares an estimate with the truth: files as ``deepuav eval`` takes them, results, maps, or (times, poses).

    ``align``: sim3, se3, yaw or none. Raises :class:`Error` for what cannot be read, associated or aligned.
    """
    if isinstance(truth, (str, os.PathLike)) and isinstance(estimate, (str, os.PathLike)):
        return evaluate_files(os.fspath(truth), os.fspath(estimate), align, max_difference_s, time_offset_s, rpe_delta,
                              rpe_unit)
    if isinstance(truth, (str, os.PathLike)) or isinstance(estimate, (str, os.PathLike)):
        raise Error("truth and estimate: expected two files, or two sets of poses")
    truth_times, truth_poses = _poses(truth)
    times, poses = _poses(estimate)
    return evaluate_poses(truth_times, truth_poses, times, poses, align, max_difference_s, time_offset_s, rpe_delta, rpe_unit)
