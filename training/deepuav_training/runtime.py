"""Running an exported network on the CPU: with OpenVINO or, where there is none, ONNX Runtime."""

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deepuav_training.errors import TrainingError
from deepuav_training.keypoints import (DetectionConfig, detect, probability_map,
                                        sample_descriptors, unit_descriptors)

Run = Callable[[dict[str, np.ndarray]], dict[str, np.ndarray]]  # inputs to outputs, by name


def compiled(path: str | Path, threads: int = 1, precision: str = "f32",
             shapes: dict[str, tuple[int, ...]] | None = None) -> Run:
    """A network ready to run.

    Args:
        path: the ONNX file, or one of OpenVINO's.
        threads: CPU threads.
        precision: what OpenVINO computes in, "f32" or "bf16"; ONNX Runtime always takes "f32".
        shapes: of all inputs, if they are known: OpenVINO is faster then.

    Raises:
        TrainingError: there is no such file, or neither runtime is installed.
    """
    if not Path(path).is_file():
        raise TrainingError(f"{path}: no such file, expected a network")
    for name, compile_with in (("openvino", _compiled_by_openvino),
                               ("onnxruntime", _compiled_by_onnxruntime)):
        if importlib.util.find_spec(name):
            return compile_with(str(path), threads, precision, shapes)
    raise TrainingError(f"{path}: found neither the package openvino nor onnxruntime, expected one "
                        "that runs networks")


def _compiled_by_openvino(path: str, threads: int, precision: str, shapes: dict | None) -> Run:
    import openvino

    core = openvino.Core()
    model = core.read_model(path)
    if shapes:
        model.reshape(shapes)
    network = core.compile_model(model, "CPU", {
        "INFERENCE_NUM_THREADS": threads, "NUM_STREAMS": 1, "INFERENCE_PRECISION_HINT": precision,
        "ENABLE_CPU_PINNING": False})  # two processes would share a core
    names = [output.get_any_name() for output in network.outputs]
    return lambda inputs: dict(zip(names, network(inputs).values(), strict=True))


def _compiled_by_onnxruntime(path: str, threads: int, _precision: str, _shapes: dict | None) -> Run:
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    names = [output.name for output in session.get_outputs()]
    return lambda inputs: dict(zip(names, session.run(names, inputs), strict=True))


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
        """Threads and precision as of `compiled`."""
        if not Path(path).is_file():
            raise TrainingError(f"{path}: no such file, expected a network")
        self._compile = lambda shape: compiled(path, threads, precision,
                                               {"image": (1, 1, *shape)})
        self._by_shape = {}

    def __call__(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Runs one grey image (H, W), uint8 or float32 in 0..1; H and W are multiples of 8.

        Returns:
            logits (65, H/8, W/8) and descriptors of length 1 (256, H/8, W/8), float32.
        """
        if image.dtype == np.uint8:
            image = image.astype(np.float32) / 255.0
        if image.shape not in self._by_shape:
            self._by_shape[image.shape] = self._compile(image.shape)
        found = self._by_shape[image.shape]({"image": image[None, None]})
        return found["logits"][0], unit_descriptors(found["descriptors"][0], axis=0)


def extract(network: Network, image: np.ndarray, detection: DetectionConfig) -> Features:
    """What a network finds in a grey image (H, W), sides multiples of 8."""
    logits, descriptors = network(image)
    points, scores = detect(probability_map(logits), detection)
    return Features(points, scores, sample_descriptors(descriptors, points), image.shape[::-1])
