from importlib.util import find_spec

import numpy as np
import pytest
import torch

from deepuav_training import runtime
from deepuav_training.errors import TrainingError
from deepuav_training.export import export_onnx
from deepuav_training.models.superpoint_small import SmallSuperPoint, SmallSuperPointConfig
from deepuav_training.runtime import Network, compiled


@pytest.fixture(name="file")
def exported(tmp_path):
    torch.manual_seed(0)
    export_onnx(SmallSuperPoint(SmallSuperPointConfig(4, 4, 4, 4, 4, 4, 4)), tmp_path / "n.onnx")
    return tmp_path / "n.onnx"


def only(monkeypatch, *names):
    monkeypatch.setattr(runtime.importlib.util, "find_spec",
                        lambda name: find_spec(name) if name in names else None)


def test_a_network_runs_on_images_of_several_sizes(file):
    network = Network(file)
    for height, width in ((16, 24), (40, 32), (16, 24)):
        logits, descriptors = network(np.full((height, width), 100, np.uint8))
        assert logits.shape == (65, height // 8, width // 8)
        np.testing.assert_allclose(np.linalg.norm(descriptors, axis=0), 1, rtol=1e-5)


def test_both_runtimes_find_the_same(file, monkeypatch):
    pytest.importorskip("openvino")
    pytest.importorskip("onnxruntime")
    image = np.random.default_rng(0).integers(0, 256, (24, 32), np.uint8)
    found = []
    for name in ("openvino", "onnxruntime"):
        only(monkeypatch, name)
        found.append(Network(file)(image))
    for a, b in zip(*found, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-4)


def test_without_a_runtime_or_a_file_a_network_is_refused(file, monkeypatch):
    with pytest.raises(TrainingError, match="none.onnx: no such file"):
        compiled("none.onnx")
    only(monkeypatch)
    with pytest.raises(TrainingError, match="neither the package openvino nor onnxruntime"):
        compiled(file)
