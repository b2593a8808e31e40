import numpy as np
import openvino
import pytest
import torch
import torch.nn.functional as F
from superglue_support import TINY, torch_inputs, trained_network

from deepuav_training.errors import TrainingError
from deepuav_training.export_superglue import (INPUTS, OUTPUT, check_export, count_macs,
                                               export_onnx, random_inputs, write_matcher)
from deepuav_training.models.superglue import SuperGlue
from deepuav_training.published_superglue import PublishedSuperGlue


def test_a_new_network_is_the_dual_softmax_matcher():
    network = SuperGlue(TINY)
    kp0, s0, d0, kp1, s1, d1 = torch_inputs((9, 7))
    network.set_projection(F.normalize(torch.randn(100, 32), dim=1))
    a, b = (F.linear(d, network.project.weight) for d in (d0, d1))
    similarity = a @ b.transpose(1, 2) / TINY.temperature
    expected = (F.log_softmax(similarity, 1) + F.log_softmax(similarity, 2)
                + 2 * F.logsigmoid(torch.tensor(TINY.matchable)))
    torch.testing.assert_close(network(kp0, s0, d0, kp1, s1, d1), expected, atol=1e-4, rtol=1e-4)


def test_projection_keeps_descriptors_of_a_subspace():
    network = SuperGlue(TINY)
    basis = torch.linalg.qr(torch.randn(32, 10))[0]
    descriptors = F.normalize(torch.randn(50, 10) @ basis.T, dim=1)
    assert network.set_projection(descriptors) == pytest.approx(1)
    projected = network.project(descriptors)
    torch.testing.assert_close(projected @ projected.T, descriptors @ descriptors.T, atol=1e-5,
                               rtol=1e-5)


def test_order_of_key_points_and_of_views_does_not_matter():
    network, inputs = trained_network(), torch_inputs((9, 7))
    plain = network(*inputs)
    turn = torch.tensor([3, 0, 2, 1, 8, 7, 6, 5, 4])
    permuted = network(*[t[:, turn] for t in inputs[:3]], *inputs[3:])
    torch.testing.assert_close(permuted, plain[:, turn], atol=1e-4, rtol=1e-4)
    swapped = network(*inputs[3:], *inputs[:3])
    torch.testing.assert_close(swapped.transpose(1, 2), plain, atol=1e-4, rtol=1e-4)


def test_padding_under_a_mask_changes_nothing():
    network, inputs = trained_network(), torch_inputs((9, 7))
    padded = [F.pad(t, (0, 0) * (t.ndim - 2) + (0, 4)) for t in inputs]
    masks = [torch.cat([torch.ones(1, count), torch.zeros(1, 4)], dim=1) for count in (9, 7)]
    torch.testing.assert_close(network(*padded, *masks)[:, :9, :7], network(*inputs), atol=1e-4,
                               rtol=1e-4)


def test_exported_network_equals_torch_at_any_count(tmp_path):
    network = trained_network()
    export_onnx(network, tmp_path / "g.onnx")
    assert check_export(network, tmp_path / "g.onnx") < 1e-3
    with torch.no_grad():
        network.matchable.bias += 1
    with pytest.raises(TrainingError, match="differs"):
        check_export(network, tmp_path / "g.onnx")


def test_cost_is_a_fraction_of_the_published_architecture():
    # 18 layers of width 256: four projections, a perceptron of 512 -> 512 -> 256, attention.
    published = 18 * (2 * 512 * (4 * 256**2 + 512 * 512 + 512 * 256) + 2 * 2 * 512**2 * 256)
    assert count_macs(SuperGlue(), 512) < 0.2 * published


def test_the_published_architecture_has_its_twelve_million_weights_and_runs(tmp_path):
    network = PublishedSuperGlue()
    assert sum(p.numel() for p in network.parameters()) == pytest.approx(12.0e6, rel=0.02)
    write_matcher(network, 256, tmp_path / "published.onnx")
    inputs = random_inputs((10, 7), 256, 3)
    compiled = openvino.Core().compile_model(str(tmp_path / "published.onnx"), "CPU")
    found = compiled(dict(zip(INPUTS, inputs, strict=True)))[OUTPUT]
    assert found.shape == (1, 10, 7) and np.isfinite(found).all()
