import copy
import datetime
from dataclasses import replace

import numpy as np
import onnx
import openvino
import pytest
import torch
from onnx import TensorProto, helper, numpy_helper

from deepuav_training.checkpoint import load_checkpoint, save_checkpoint, start_from
from deepuav_training.data.pairs import Sample, cell_labels, nearest_points
from deepuav_training.errors import TrainingError
from deepuav_training.export import check_export, export_onnx, rounded_to_16_bits
from deepuav_training.models.superpoint_large import LargeSuperPoint
from deepuav_training.models.superpoint_small import (Residual, SmallSuperPoint,
                                                      SmallSuperPointConfig, count_macs)
from deepuav_training.onnx_storage import constants, expand, halve, without_norm
from deepuav_training.onnx_weights import load_exported
from deepuav_training.runtime import Network
from deepuav_training.train_superpoint import TrainConfig, collate, losses_of, new_state
from deepuav_training.training_run import (Objective, Pace, learning_rate, next_moment,
                                           train_step)

TINY = SmallSuperPointConfig(half=4, quarter=4, eighth=8, deep=8, detail=4, head=8,
                             descriptor_hidden=8)
CONFIG = TrainConfig(network=TINY, batch=2, bfloat16=False, steps=40, learning_rate=0.01)


def tiny_batch(seed):
    rng = np.random.default_rng(seed)
    samples = []
    for _ in range(CONFIG.batch):
        points = rng.uniform(8, 40, (6, 2)).astype(np.float32)
        image = rng.integers(0, 256, (48, 48)).astype(np.uint8)
        cells = cell_labels(points, np.full(6, 0.9), 48, 48, 0.6)
        descriptors = np.eye(6, 256, dtype=np.float32)
        samples.append(Sample(np.stack([image, image]), np.stack([cells, cells]),
                              np.ones((2, 6, 6), bool),
                              np.stack([nearest_points(points, 48, 48)] * 2),
                              np.stack([points, points]), descriptors, 5))
    return collate(samples)


def learn(state, seed):
    """A step on the batch of that seed."""
    batch = tiny_batch(seed)
    fixed = Objective(lambda network, _: losses_of(network, batch, CONFIG),
                      {"detector": 1.0, "position": 0.5, "distillation": 2.0, "matching": 0.3})
    return train_step(state, fixed, CONFIG)


def weights(state):
    return torch.cat([p.flatten() for p in state.average.state_dict().values()])


@pytest.mark.parametrize("network", [SmallSuperPoint, LargeSuperPoint])
def test_outputs_have_the_published_layout(network):
    logits, descriptors = network()(torch.rand(2, 1, 40, 56))
    assert logits.shape == (2, 65, 5, 7) and descriptors.shape == (2, 256, 5, 7)
    torch.testing.assert_close(descriptors.norm(dim=1), torch.ones(2, 5, 7))


def test_cost_stays_within_a_fifth_of_the_large_network():
    assert count_macs(SmallSuperPoint(), 480, 752) < count_macs(LargeSuperPoint(), 480, 752) / 5


def test_macs_of_one_convolution():
    assert count_macs(torch.nn.Conv2d(1, 4, 3, stride=2, padding=1), 8, 12) == 36 * 4 * 6


def test_residual_block_starts_as_the_identity():
    x = torch.rand(1, 8, 6, 6)
    torch.testing.assert_close(Residual(8)(x), x)


def test_collating_puts_labelled_views_first():
    batch = tiny_batch(0)
    assert batch.images.shape == (4, 1, 48, 48) and batch.points.shape == (4, 6, 2)
    assert batch.valid.tolist() == [[True] * 5 + [False]] * 2
    torch.testing.assert_close(batch.images[0], batch.images[2])
    assert not torch.equal(batch.images[0], batch.images[1])


def test_training_lowers_every_loss():
    state = new_state(CONFIG)
    state.progress = CONFIG.warmup
    first = learn(state, 0)
    for _ in range(40):
        last = learn(state, 0)
    assert all(last[name] < 0.9 * first[name] for name in first), (first, last)


def test_training_resumes_exactly(tmp_path):
    straight, pace = new_state(CONFIG), Pace(CONFIG.steps, None)
    for step in range(6):
        learn(straight, step)
        straight.progress = pace.advance(straight.progress)
        if step == 2:
            save_checkpoint(tmp_path / "c.pt", straight)
    resumed = new_state(TrainConfig(network=TINY, batch=2, bfloat16=False, seed=99))
    load_checkpoint(tmp_path / "c.pt", resumed)
    for step in range(resumed.step, 6):
        learn(resumed, step)
        resumed.progress = pace.advance(resumed.progress)
    assert resumed.step == straight.step and resumed.progress == straight.progress
    assert torch.equal(weights(straight), weights(resumed))


def test_a_new_run_starts_from_averaged_weights(tmp_path):
    earlier = new_state(CONFIG)
    for step in range(3):
        learn(earlier, step)
    save_checkpoint(tmp_path / "c.pt", earlier)
    state = new_state(TrainConfig(network=TINY, seed=99))
    start_from(tmp_path / "c.pt", state)
    assert torch.equal(weights(state), weights(earlier))
    for name, value in earlier.average.state_dict().items():
        assert torch.equal(state.network.state_dict()[name], value)
    assert state.step == 0 and state.progress == 0 and not state.optimiser.state


@pytest.mark.parametrize("load", [load_checkpoint, start_from])
def test_checkpoint_of_another_network_is_refused(tmp_path, load):
    save_checkpoint(tmp_path / "c.pt", new_state(CONFIG))
    with pytest.raises(TrainingError, match="c.pt"):
        load(tmp_path / "c.pt", new_state(TrainConfig()))


def test_learning_rate_rises_and_falls():
    assert learning_rate(0, CONFIG) < 0.1 * CONFIG.learning_rate
    assert learning_rate(CONFIG.warmup, CONFIG) == pytest.approx(CONFIG.learning_rate)
    assert learning_rate(1, CONFIG) == pytest.approx(0.01 * CONFIG.learning_rate)


def test_a_schedule_has_as_many_steps_as_it_says():
    pace, progress, steps = Pace(49, None), 0.0, 0
    while progress < 1:
        progress, steps = pace.advance(progress), steps + 1
    assert steps == 49


def test_exported_network_equals_torch_at_any_size(tmp_path):
    network = SmallSuperPoint(TINY)
    network.train()(torch.rand(4, 1, 48, 48))  # statistics to be folded
    export_onnx(network, tmp_path / "n.onnx")
    logits, descriptors = check_export(network, tmp_path / "n.onnx")
    assert logits < 2e-3 and descriptors < 1e-4


def test_an_exported_file_leaves_the_descriptors_length_to_its_user(tmp_path):
    torch.manual_seed(8)
    network = SmallSuperPoint(TINY).eval()
    export_onnx(network, tmp_path / "n.onnx")
    model = onnx.load(str(tmp_path / "n.onnx"))
    assert {"Div", "ReduceL2", "Shape"}.isdisjoint(node.op_type for node in model.graph.node)
    assert without_norm(model) == model
    raw = compiled_output(tmp_path / "n.onnx", "descriptors", torch.rand(1, 1, 24, 32))
    assert np.abs(np.linalg.norm(raw, axis=1) - 1).min() > 1e-3
    _, found = Network(tmp_path / "n.onnx")(np.random.default_rng(1).random((24, 32), np.float32))
    np.testing.assert_allclose(np.linalg.norm(found, axis=0), 1, rtol=1e-5)


def compiled_output(path, name, image):
    return openvino.Core().compile_model(str(path), "CPU")(image.numpy())[name]


def test_export_of_other_weights_is_noticed(tmp_path):
    network = SmallSuperPoint(TINY)
    export_onnx(network, tmp_path / "n.onnx")
    other = copy.deepcopy(network)
    with torch.no_grad():
        other.detector[-1].bias += 0.1
    with pytest.raises(TrainingError, match="differ"):
        check_export(other, tmp_path / "n.onnx")


def noisy(network, seed):
    """Gives every normalisation statistics and gains as training leaves them."""
    generator = torch.Generator().manual_seed(seed)
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            for value in (module.running_mean, module.bias):
                value.copy_(torch.randn(value.shape, generator=generator))
            for value in (module.running_var, module.weight):
                value.copy_(torch.rand(value.shape, generator=generator) + 0.5)


@torch.no_grad()
def test_training_goes_on_from_an_exported_file(tmp_path):
    torch.manual_seed(5)
    trained, restored = SmallSuperPoint(TINY).eval(), SmallSuperPoint(TINY).train()
    noisy(trained, 6)
    export_onnx(trained, tmp_path / "trained.onnx")
    images = torch.rand(6, 1, 64, 48)
    load_exported(tmp_path / "trained.onnx", restored, images)
    assert restored.training
    unseen = torch.rand(2, 1, 40, 56)
    torch.testing.assert_close(restored.eval()(unseen), trained(unseen), rtol=1e-3, atol=1e-4)
    # With the images' own statistics training computes the same as use does.
    torch.testing.assert_close(restored.train()(images), trained(images), rtol=1e-3, atol=1e-3)


@torch.no_grad()
def test_training_goes_on_from_a_file_without_the_new_layers(tmp_path):
    torch.manual_seed(5)
    trained = SmallSuperPoint(TINY).eval()
    larger = SmallSuperPoint(replace(TINY, quarter_detail=3)).train()
    noisy(trained, 6)
    export_onnx(trained, tmp_path / "trained.onnx")
    load_exported(tmp_path / "trained.onnx", larger, torch.rand(6, 1, 64, 48), ("quarter_detail",))
    unseen = torch.rand(2, 1, 40, 56)
    torch.testing.assert_close(larger.eval()(unseen), trained(unseen), rtol=1e-3, atol=1e-4)
    with pytest.raises(TrainingError, match="other shapes"):
        load_exported(tmp_path / "trained.onnx", larger, unseen)


def test_a_time_of_the_day_that_has_passed_is_tomorrows():
    evening = datetime.datetime(2026, 3, 31, 23, 30)
    assert next_moment("23:45", evening) == datetime.datetime(2026, 3, 31, 23, 45)
    assert next_moment("06:00", evening) == datetime.datetime(2026, 4, 1, 6, 0)
    assert next_moment("23:30", evening) == datetime.datetime(2026, 4, 1, 23, 30)


def test_the_large_network_goes_on_from_its_file(tmp_path):
    torch.manual_seed(7)
    config = TrainConfig(size="large", batch=2, bfloat16=False)
    trained, restored = new_state(config).network, LargeSuperPoint()
    export_onnx(trained, tmp_path / "large.onnx")
    load_exported(tmp_path / "large.onnx", restored, torch.rand(1, 1, 16, 16))
    check_export(restored, tmp_path / "large.onnx")


def test_weights_stored_in_16_bits_are_half_as_large_and_restored(tmp_path):
    torch.manual_seed(8)
    network, restored = LargeSuperPoint().eval(), LargeSuperPoint()
    export_onnx(network, tmp_path / "full.onnx")
    export_onnx(network, tmp_path / "half.onnx", in_16_bits=True)
    sizes = [(tmp_path / name).stat().st_size for name in ("half.onnx", "full.onnx")]
    assert sizes[0] < 0.51 * sizes[1]
    check_export(rounded_to_16_bits(network), tmp_path / "half.onnx")
    load_exported(tmp_path / "half.onnx", restored, torch.rand(1, 1, 16, 16))
    check_export(restored, tmp_path / "half.onnx")
    before = constants(onnx.load(tmp_path / "full.onnx"))
    after = constants(onnx.load(tmp_path / "half.onnx"))
    assert before.keys() == after.keys()
    assert all(np.allclose(before[name], after[name], atol=1e-3) for name in before)


def test_conversions_of_other_values_stay_when_weights_are_expanded():
    values = numpy_helper.from_array(np.ones((32, 32), np.float32), "weight")
    nodes = [helper.make_node("Cast", ["x"], ["onnx::Cast_16"], to=TensorProto.DOUBLE),
             helper.make_node("Cast", ["onnx::Cast_16"], ["y"], to=TensorProto.FLOAT),
             helper.make_node("Add", ["y", "weight"], ["z"])]
    ends = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [32, 32]) for name in "xz"]
    model = helper.make_model(helper.make_graph(nodes, "g", ends[:1], ends[1:], [values]))
    halved = halve(model)
    assert [node.op_type for node in halved.graph.node] == ["Cast", "Cast", "Cast", "Add"]
    restored = expand(halved)
    assert [node.op_type for node in restored.graph.node] == ["Cast", "Cast", "Add"]
    np.testing.assert_array_equal(constants(halved)["weight"], 1)


def test_frozen_parameters_stay_and_the_others_learn():
    config = TrainConfig(network=TINY, batch=2, bfloat16=False, frozen=("at_half",))
    state = new_state(config)
    before = {name: value.clone() for name, value in state.network.named_parameters()}

    def losses(network, _step):
        logits, descriptors = network(torch.rand(2, 1, 32, 32))
        return {"some": logits.square().mean() + descriptors[:, 0].mean()}

    train_step(state, Objective(losses, {"some": 1.0}), config)
    moved = {name for name, value in state.network.named_parameters()
             if not torch.equal(value, before[name])}
    assert moved and not any(name.startswith("at_half") for name in moved)


def test_freezing_what_is_not_there_is_refused():
    with pytest.raises(TrainingError, match="frozen.*encoder.9"):
        TrainConfig(size="large", frozen=("encoder.9",)).check("run.yaml")


def test_a_network_of_unknown_size_is_refused():
    with pytest.raises(TrainingError, match="size.*medium"):
        TrainConfig(size="medium").check("run.yaml")


def test_a_file_of_other_layers_is_refused(tmp_path):
    export_onnx(SmallSuperPoint(TINY).eval(), tmp_path / "tiny.onnx")
    with pytest.raises(TrainingError, match="tiny.onnx.*other shapes"):
        load_exported(tmp_path / "tiny.onnx", SmallSuperPoint(), torch.rand(1, 1, 16, 16))


def test_a_file_that_is_no_network_is_refused(tmp_path):
    (tmp_path / "text.onnx").write_text("hello")
    with pytest.raises(TrainingError, match="text.onnx"):
        load_exported(tmp_path / "text.onnx", SmallSuperPoint(TINY), torch.rand(1, 1, 16, 16))
