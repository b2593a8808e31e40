from dataclasses import replace

import numpy as np
import pytest
import torch
from superglue_support import CONFIG, TINY, torch_inputs, trained_network

from deepuav_training.checkpoint import load_checkpoint, save_checkpoint, start_from
from deepuav_training.config import from_mapping
from deepuav_training.data.matches import MISTAKABLE, UNKNOWN, UNMATCHED
from deepuav_training.errors import TrainingError
from deepuav_training.export_superglue import export_onnx
from deepuav_training.matching_losses import assignment_loss, unmatched_loss
from deepuav_training.models.superglue import SuperGlue, SuperGlueConfig
from deepuav_training.pair_batches import collate
from deepuav_training.train_superglue import (GlueTrainConfig, losses_of, new_state,
                                              objective)
from deepuav_training.training_run import (Objective, finish_run, run_arguments, start_run,
                                           train_step)


def test_assignment_loss_is_that_of_the_true_pairs():
    log = torch.log(torch.tensor([[[0.5, 0.1], [0.2, 0.25]]]))
    both = assignment_loss(log, torch.tensor([[0, 1]]))
    assert both.item() == pytest.approx(-0.5 * (np.log(0.5) + np.log(0.25)))
    one = assignment_loss(log, torch.tensor([[UNMATCHED, 0]]))
    assert one.item() == pytest.approx(-np.log(0.2))
    assert assignment_loss(log, torch.full((1, 2), UNKNOWN)) == 0


def test_a_pair_of_few_matches_counts_as_much_as_one_of_many():
    log = torch.log(torch.tensor([[[0.5, 0.1], [0.1, 0.5]], [[0.1, 0.1], [0.1, 0.2]]]))
    match0 = torch.tensor([[0, 1], [UNKNOWN, 1]])
    assert assignment_loss(log, match0).item() == pytest.approx(-0.5 * np.log(0.5 * 0.2))
    none = torch.full((2, 2), UNKNOWN)
    assert assignment_loss(log, none).item() == 0


def test_unmatched_loss_leaves_out_what_is_unknown():
    z0, z1 = torch.tensor([[2.0, 9.0]]), torch.tensor([[-1.0]])
    match0 = torch.tensor([[UNMATCHED, UNKNOWN]])
    expected = 0.5 * (np.log1p(np.exp(2)) + np.log1p(np.exp(-1)))
    loss = unmatched_loss(z0, z1, match0, torch.tensor([[UNMATCHED]]))
    assert loss.item() == pytest.approx(expected, rel=1e-5)
    assert unmatched_loss(z0, z1, torch.tensor([[0, 1]]), torch.tensor([[0]])) == 0


def test_mistakable_points_weigh_as_much_as_is_said():
    z0, z1 = torch.tensor([[2.0, -1.0, 9.0]]), torch.tensor([[9.0]])
    match0, match1 = torch.tensor([[UNMATCHED, MISTAKABLE, UNKNOWN]]), torch.tensor([[UNKNOWN]])
    expected = 0.5 * (np.log1p(np.exp(2)) + 3 * np.log1p(np.exp(-1))) / 4
    loss = unmatched_loss(z0, z1, match0, match1, mistakable=3)
    assert loss.item() == pytest.approx(expected, rel=1e-5)


def test_a_row_of_little_weight_is_a_mean_too():
    alone = unmatched_loss(torch.tensor([[2.0]]), torch.tensor([[9.0]]),
                           torch.tensor([[MISTAKABLE]]), torch.tensor([[UNKNOWN]]), mistakable=0.25)
    assert alone.item() == pytest.approx(0.5 * np.log1p(np.exp(2)), rel=1e-5)


def test_training_finds_matches_and_what_has_none(source):
    state = new_state(CONFIG, source)
    batch = collate([source.draw(k) for k in range(4)])
    fixed = Objective(lambda network, _: losses_of(network, batch, CONFIG),
                      objective(source, CONFIG).weights)
    state.progress = CONFIG.warmup
    first = train_step(state, fixed, CONFIG)
    for _ in range(60):
        last = train_step(state, fixed, CONFIG)
    assert last["assignment"] < 0.6 * first["assignment"]
    assert last["unmatched"] < 0.6 * first["unmatched"]


def test_a_device_that_is_not_there_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    config = replace(CONFIG, run=str(tmp_path), device="cuda")
    with pytest.raises(TrainingError, match="run.yaml: device: found cuda, expected cpu"):
        start_run(config, run_arguments("").parse_args(["--config", "run.yaml"]))


@pytest.mark.parametrize("tree,message", [
    ({"device": "gpu"}, "device: found 'gpu', expected cpu or cuda"),
    ({"workers": -1}, "workers: found -1, expected at least 0"),
    ({"matches": {"more_share": 0.5}}, "more_points: found 0, expected at least 1"),
])
def test_impossible_runs_are_refused(tree, message):
    with pytest.raises(TrainingError, match=message):
        from_mapping(GlueTrainConfig, tree, "run")


def test_a_schedule_ends_after_so_many_seconds(source, tmp_path):
    config = replace(CONFIG, run=str(tmp_path), steps=10**6)
    arguments = run_arguments("").parse_args(["--config", "run.yaml", "--seconds", "0.5"])
    state = new_state(config, source)
    finish_run(state, objective(source, config), config, arguments)
    assert state.progress == 1 and 0 < state.step < 10**6
    with pytest.raises(SystemExit):
        run_arguments("").parse_args(["--config", "c", "--seconds", "5", "--until", "12:00"])


def test_training_resumes_exactly(source, tmp_path):
    straight, goal = new_state(CONFIG, source), objective(source, CONFIG)
    for step in range(4):
        train_step(straight, goal, CONFIG)
        if step == 1:
            save_checkpoint(tmp_path / "c.pt", straight)
    resumed = new_state(GlueTrainConfig(network=TINY, bfloat16=False, seed=99), None)
    load_checkpoint(tmp_path / "c.pt", resumed)
    for _ in range(2):
        train_step(resumed, goal, CONFIG)
    for name, value in straight.average.state_dict().items():
        assert torch.equal(resumed.average.state_dict()[name], value), name


def test_a_new_run_goes_on_from_an_exported_file(tmp_path):
    trained = trained_network()
    export_onnx(trained, tmp_path / "glue.onnx")
    state = new_state(CONFIG, None)
    start_from(tmp_path / "glue.onnx", state)
    for restored in (state.network, state.average):
        for name, value in trained.state_dict().items():
            torch.testing.assert_close(restored.state_dict()[name], value, atol=1e-3, rtol=1e-3)


def test_added_layers_do_nothing_at_first(tmp_path):
    trained, inputs = trained_network(), torch_inputs((9, 7))
    export_onnx(trained, tmp_path / "glue.onnx")
    deeper = GlueTrainConfig(network=replace(TINY, layers=3), bfloat16=False,
                             added=("self_layers.2", "cross_layers.2"))
    state = new_state(deeper, None)
    start_from(tmp_path / "glue.onnx", state, deeper.added)
    for network in (state.network, state.average):
        torch.testing.assert_close(network(*inputs), trained(*inputs), atol=1e-2, rtol=1e-2)
    with pytest.raises(TrainingError, match="glue.onnx"):
        start_from(tmp_path / "glue.onnx", state, ("self_layers.2",))


def test_a_run_does_not_go_on_from_a_file_of_another_network(tmp_path):
    export_onnx(SuperGlue(SuperGlueConfig(descriptor=32, width=8, heads=1, layers=1)),
                tmp_path / "other.onnx")
    with pytest.raises(TrainingError, match="other.onnx"):
        start_from(tmp_path / "other.onnx", new_state(CONFIG, None))
