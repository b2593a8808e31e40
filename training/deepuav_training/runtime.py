"""Running an exported network with OpenVINO."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import openvino

from deepuav_training.errors import TrainingError
from deepuav_training.keypoints import (DetectionConfig, detect, probability_map,
                                        sample_descriptors, unit_descriptors)


@dataclass(frozen=True)
class Features:
    """Key points of one image, the best first."""

    points: np.ndarray  # (N, 2) float32, pixels
    scores: np.ndarray  # (N,) float32
    descriptors: np.ndarray  # (N, C) float32, of length 1
    size: tuple[int, int]  # of the image: width, height


class Network:
    """An ONNX (or OpenVINO) SuperPoint: image in, logits and descriptors out."""

    def __init__(self, path: str | Path, threads: int = 1, precision: str = "f32"):
        """Loads and compiles the network.

        Args:
            path: the model file.
            threads: CPU threads.
            precision: what the runtime computes in, "f32" or "bf16".
        """
        if not Path(path).is_file():
            raise TrainingError(f"{path}: no such file, expected a network")
        self._core = openvino.Core()
        self._model = self._core.read_model(str(path))
        self._settings = {"INFERENCE_NUM_THREADS": threads, "NUM_STREAMS": 1,
                          "INFERENCE_PRECISION_HINT": precision,
                          "ENABLE_CPU_PINNING": False}  # two processes would share a core
        self._requests = {}

    def __call__(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Runs one grey image (H, W), uint8 or float32 in 0..1; H and W are multiples of 8.

        Returns:
            logits (65, H/8, W/8) and descriptors of length 1 (256, H/8, W/8), float32.
        """
        if image.dtype == np.uint8:
            image = image.astype(np.float32) / 255.0
        request = self._request(image.shape)
        request.infer([image[None, None]])
        return (request.get_tensor("logits").data[0].copy(),
                unit_descriptors(request.get_tensor("descriptors").data[0], axis=0))

    def _request(self, shape: tuple[int, int]) -> openvino.InferRequest:
        if shape not in self._requests:
            model = self._model.clone()
            model.reshape([1, 1, *shape])
            compiled = self._core.compile_model(model, "CPU", self._settings)
            self._requests[shape] = compiled.create_infer_request()
        return self._requests[shape]


def extract(network: Network, image: np.ndarray, detection: DetectionConfig) -> Features:
    """What a network finds in a grey image (H, W), sides multiples of 8."""
    logits, descriptors = network(image)
    points, scores = detect(probability_map(logits), detection)
    return Features(points, scores, sample_descriptors(descriptors, points), image.shape[::-1])
