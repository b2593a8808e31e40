"""Image sequences with true poses, for evaluation only: EuRoC (ASL) and TUM folders."""

import csv
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import yaml

from deepuav_training.errors import TrainingError


@dataclass(frozen=True)
class Sequence:
    """Frames of one calibrated camera."""

    files: list[Path]
    world_from_camera: np.ndarray  # (N, 4, 4), metres
    camera_matrix: np.ndarray  # (3, 3)
    distortion: np.ndarray  # radial-tangential, as OpenCV's; empty for none


def read_sequence(folder: str | Path, focal_px: float | None = None) -> Sequence:
    """Reads the frames that have a true pose within 2 ms; `focal_px` replaces the focal length."""
    folder = Path(folder)
    try:
        if (folder / "mav0").is_dir():
            sequence = _read_euroc(folder)
        elif (folder / "rgb.txt").is_file():
            sequence = _read_tum(folder)
        else:
            raise TrainingError(f"{folder}: found neither mav0/ nor rgb.txt, expected a sequence")
    except (OSError, KeyError, ValueError, IndexError) as error:
        raise TrainingError(f"{folder}: cannot be read as a sequence: {error}") from error
    if focal_px:
        sequence.camera_matrix[[0, 1], [0, 1]] = focal_px
    return sequence


def load_undistorted(sequence: Sequence, index: int, long_side: int
                     ) -> tuple[np.ndarray, np.ndarray]:
    """A frame without distortion, `long_side` pixels long and cut to whole cells of 8 pixels.

    Returns:
        (H, W) uint8 and its camera matrix (3, 3).
    """
    image = cv2.imread(str(sequence.files[index]), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise TrainingError(f"{sequence.files[index]}: cannot be decoded, expected an image")
    if len(sequence.distortion):
        image = cv2.undistort(image, sequence.camera_matrix, sequence.distortion)
    scale = long_side / max(image.shape)
    size = (round(image.shape[1] * scale), round(image.shape[0] * scale))
    resized_from_image = np.array([[size[0] / image.shape[1], 0, 0],
                                   [0, size[1] / image.shape[0], 0], [0, 0, 1]])
    centre_to_corner = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
    matrix = (np.linalg.inv(centre_to_corner) @ resized_from_image @ centre_to_corner
              @ sequence.camera_matrix)
    image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(image[: size[1] // 8 * 8, : size[0] // 8 * 8]), matrix


def _read_euroc(folder: Path) -> Sequence:
    camera = folder / "mav0" / "cam0"
    sensor = yaml.safe_load((camera / "sensor.yaml").read_text())
    fx, fy, cx, cy = sensor["intrinsics"]
    frames = [(int(row[0]) * 1e-9, camera / "data" / row[1].strip())
              for row in _rows(camera / "data.csv", ",")]
    poses = [[float(v) for v in row] for row in _rows(folder / "groundtruth_cam0.csv", ",")]
    stamps = np.array([int(row[0]) * 1e-9 for row in _rows(folder / "groundtruth_cam0.csv", ",")])
    matrices = [_pose(row[1:4], row[5:8], row[4]) for row in poses]
    return _join(frames, stamps, matrices, np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]),
                 np.array(sensor["distortion_coefficients"], float))


def _read_tum(folder: Path) -> Sequence:
    camera = yaml.safe_load((folder / "camera.yaml").read_text())
    matrix = np.array([[camera["fx"], 0, camera["cx"]], [0, camera["fy"], camera["cy"]],
                       [0, 0, 1.0]])
    frames = [(float(row[0]), folder / row[1]) for row in _rows(folder / "rgb.txt", None)]
    poses = [[float(v) for v in row] for row in _rows(folder / "groundtruth.txt", None)]
    matrices = [_pose(row[1:4], row[4:7], row[7]) for row in poses]
    return _join(frames, np.array([row[0] for row in poses]), matrices, matrix,
                 np.array(camera.get("distortion") or [], float))


def _rows(path: Path, separator: str | None) -> list[list[str]]:
    lines = [line for line in path.read_text().splitlines() if line and not line.startswith("#")]
    return list(csv.reader(lines)) if separator else [line.split() for line in lines]


def _pose(position: list[float], xyz: list[float], w: float) -> np.ndarray:
    """4x4 of a position and a quaternion."""
    x, y, z = xyz
    norm = np.sqrt(x * x + y * y + z * z + w * w)
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    matrix = np.eye(4)
    matrix[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                      [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                      [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    matrix[:3, 3] = position
    return matrix


def _join(frames: list, stamps: np.ndarray, matrices: list, camera_matrix: np.ndarray,
          distortion: np.ndarray) -> Sequence:
    files, poses = [], []
    for stamp, file in frames:
        nearest = int(np.abs(stamps - stamp).argmin())
        if abs(stamps[nearest] - stamp) < 2e-3 and file.is_file():
            files.append(file)
            poses.append(matrices[nearest])
    return Sequence(files, np.array(poses), camera_matrix, distortion)
