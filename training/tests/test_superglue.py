import gc
import os
from dataclasses import replace
from functools import partial

import numpy as np
import openvino
import pytest
import torch
import torch.nn.functional as F

from deepuav_training.checkpoint import load_checkpoint, save_checkpoint, start_from
from deepuav_training.config import from_mapping
from deepuav_training.data.matches import (MISTAKABLE, UNKNOWN, UNMATCHED, MatchConfig,
                                           MatchSource, make_sample, normalise, preferred_pairs,
                                           similarity_between, true_matches, turned)
from deepuav_training.errors import TrainingError
from deepuav_training.export_superglue import (INPUTS, OUTPUT, check_export, count_macs,
                                               export_onnx, random_inputs, write_matcher)
from deepuav_training.matching_losses import assignment_loss, unmatched_loss
from deepuav_training.models.superglue import SuperGlue, SuperGlueConfig
from deepuav_training.published_superglue import PublishedSuperGlue
from deepuav_training.scene_cache import SceneFeatures, cached_scenes, save_scene, scene_path
from deepuav_training.pair_batches import PairBatches, collate
from deepuav_training.train_superglue import (GlueTrainConfig, losses_of, new_state,
                                              objective)
from deepuav_training.training_run import (Objective, finish_run, run_arguments, start_run,
                                           train_step)

TINY = SuperGlueConfig(descriptor=32, width=16, heads=2, layers=2, hidden=16)
CONFIG = GlueTrainConfig(network=TINY, batch=4, bfloat16=False, steps=40, learning_rate=0.003,
                         matches=MatchConfig(points=12, least_matches=1))
NAN = [np.nan, np.nan]


def tiny_scene(seed, views=3, count=16):
    """The same points in every view; their descriptors differ by noise, those of half are alike."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(10, 90, (views, count, 2)).astype(np.float32)
    clean = rng.standard_normal((count, TINY.descriptor))
    clean[: count // 2] = clean[0]
    noisy = clean + 0.3 * rng.standard_normal((views, *clean.shape))
    descriptors = noisy / np.linalg.norm(noisy, axis=2, keepdims=True)
    seen_at = np.tile(points[None], (views, 1, 1, 1))
    seen_at[:, :, :2] = np.nan  # two that no other view shows
    return SceneFeatures(points, rng.uniform(0, 1, (views, count)).astype(np.float32),
                         descriptors.astype(np.float32), seen_at, np.array([100, 100], np.int32))


@pytest.fixture(name="source")
def tiny_source(tmp_path):
    for index in range(3):
        save_scene(scene_path(tmp_path / "scenes", index), tiny_scene(index))
    return MatchSource(partial(cached_scenes, tmp_path / "scenes", 5, "cache_scenes"),
                       CONFIG.matches, seed=1)


def torch_inputs(counts, seed=0):
    return list(map(torch.from_numpy, random_inputs(counts, TINY.descriptor, seed)))


def trained_network():
    torch.manual_seed(1)
    network = SuperGlue(TINY)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(0.2 * torch.randn(parameter.shape))
    return network


def test_true_matches_are_mutual_and_near():
    points0 = np.array([[10.0, 10], [30, 10], [50, 10], [70, 10]])
    points1 = np.array([[11.0, 10], [34, 10], [90, 90]])
    match0, match1 = true_matches(points0, points1, points0, points1, MatchConfig())
    assert match0.tolist() == [0, UNKNOWN, UNMATCHED, UNMATCHED]
    assert match1.tolist() == [0, UNKNOWN, UNMATCHED]


def test_unmatched_points_with_another_near_are_mistakable():
    points0 = np.array([[10.0, 10], [34, 10], [50, 10], [70, 10]])
    points1 = np.array([[11.0, 10], [30, 10], [56, 10], [90, 10]])
    config = MatchConfig(apart_px=5, mistakable_px=10)
    match0, match1 = true_matches(points0, points1, points0, points1, config)
    assert match0.tolist() == [0, UNKNOWN, MISTAKABLE, UNMATCHED]
    assert match1.tolist() == [0, UNKNOWN, MISTAKABLE, UNMATCHED]


def test_of_two_candidates_the_nearer_matches():
    points0, points1 = np.array([[10.0, 10], [12, 10]]), np.array([[10.5, 10]])
    match0, match1 = true_matches(points0, points1, points0, points1, MatchConfig())
    assert match0.tolist() == [0, UNKNOWN] and match1.tolist() == [0]


def test_points_that_the_other_view_does_not_show_have_no_match():
    points = np.array([[10.0, 10], [30, 10]])
    seen = np.array([NAN, [30, 10]])
    match0, match1 = true_matches(points, points, seen, points, MatchConfig())
    assert match0.tolist() == [UNMATCHED, 1] and match1.tolist() == [UNKNOWN, 1]


def test_positions_are_normalised_by_the_longer_side():
    points = normalise(np.array([[0.0, 0], [480, 360], [240, 180]]), np.array([480, 360]))
    np.testing.assert_allclose(points, [[-1, -0.75], [1, 0.75], [0, 0]])


def test_samples_repeat_and_keep_their_rows_together(source):
    assert len(source) == 3
    first, again = source.draw(7), source.draw(7)
    np.testing.assert_array_equal(first.descriptors, again.descriptors)
    assert first.keypoints.shape == (2, 12, 2) and first.descriptors.shape == (2, 12, 32)
    rows = np.flatnonzero(first.match[0] >= 0)
    assert len(rows) >= 4
    np.testing.assert_array_equal(first.match[1][first.match[0][rows]], rows)
    assert not np.array_equal(first.keypoints, source.draw(8).keypoints)


def test_batches_are_the_same_whoever_draws_them(source):
    own, others = PairBatches(source, 2), PairBatches(source, 2, workers=2)
    for step in (0, 1, 2, 7, 8):  # one after another, and after a jump
        for a, b in zip(vars(own.at(step)).values(), vars(others.at(step)).values(), strict=True):
            assert all(torch.equal(x, y) for x, y in zip(a, b, strict=True))
    assert torch.equal(own.at(1).keypoints[0][0], torch.from_numpy(source.draw(2).keypoints[0]))


class LeftInACycle:
    """Only the garbage collector frees it; that ends any process but the one that made it."""

    def __init__(self):
        self.itself, self.maker = self, os.getpid()

    def __del__(self):
        if os.getpid() != self.maker:
            os._exit(1)


class CollectingSource(MatchSource):
    """Collects garbage wherever it draws."""

    def draw(self, number, points=None):
        gc.collect()
        return super().draw(number, points)


def test_those_who_draw_inherit_nothing_of_the_run(source, tmp_path):
    LeftInACycle()
    scenes = partial(cached_scenes, tmp_path / "scenes", 5, "cache_scenes")
    batches = PairBatches(CollectingSource(scenes, CONFIG.matches, 1), 2, workers=1)
    assert batches.at(0).scores[0].shape == (2, 12)


def test_some_batches_have_more_points(tmp_path):
    save_scene(scene_path(tmp_path, 0), tiny_scene(0))
    config = MatchConfig(points=6, more_points=14, more_share=0.5, least_matches=1)
    batches = PairBatches(MatchSource(lambda: cached_scenes(tmp_path, 1, ""), config, seed=1), 2)
    counts = [batches.at(step).scores[0].shape[1] for step in range(20)]
    assert set(counts) == {6, 14}
    assert counts == [batches.at(step).scores[0].shape[1] for step in range(20)]


@pytest.mark.parametrize("relist_s,expected", [(np.inf, 1), (-1.0, 2)])
def test_scenes_made_meanwhile_are_taken_in_if_asked_for(tmp_path, relist_s, expected):
    save_scene(scene_path(tmp_path, 0), tiny_scene(0))
    source = MatchSource(lambda: cached_scenes(tmp_path, 2, ""), CONFIG.matches, 1, relist_s)
    save_scene(scene_path(tmp_path, 1), tiny_scene(1))
    source.draw(0)
    assert len(source) == expected


def scene_of_turns(angles_deg, scales):
    """Views of the same points, turned and scaled about the middle."""
    rng = np.random.default_rng(4)
    middle = rng.uniform(-20, 20, 40) + 1j * rng.uniform(-20, 20, 40)
    seen = [50 + 50j + middle * scale * np.exp(1j * np.radians(angle))
            for angle, scale in zip(angles_deg, scales, strict=True)]
    points = np.stack([np.stack([z.real, z.imag], axis=1) for z in seen]).astype(np.float32)
    count = len(seen)
    descriptors = np.tile(np.eye(40, TINY.descriptor, dtype=np.float32), (count, 1, 1))
    return SceneFeatures(points, np.ones((count, 40), np.float32), descriptors,
                         np.tile(points[None], (count, 1, 1, 1)), np.array([100, 100], np.int32))


def test_similarity_between_views_is_that_of_what_both_see():
    scene = scene_of_turns([0, 100], [1, 1.5])
    assert similarity_between(scene, 0, 1) == pytest.approx(1.5 * np.exp(1j * np.radians(100)))
    scene.seen_at[0, 1, 10:] = np.nan
    assert np.isnan(similarity_between(scene, 0, 1))


@pytest.mark.parametrize("step,turned_far,expected", [(1.0, 0.0, {(0, 1), (1, 0)}),
                                                      (0.0, 1.0, {(0, 2), (1, 2), (2, 0), (2, 1)})])
def test_pairs_of_the_kind_that_is_drawn_come_first(step, turned_far, expected):
    scene = scene_of_turns([0, 10, 170], [1, 1.2, 1])
    config = MatchConfig(step_share=step, turned_share=turned_far)
    rng = np.random.default_rng(2)
    first = {preferred_pairs(scene, config, rng)[0] for _ in range(40)}
    assert first == expected


def test_the_best_key_points_are_taken_unless_a_choice_is_drawn():
    scene, rng = tiny_scene(1), np.random.default_rng(3)
    best = make_sample(scene, 0, 1, MatchConfig(random_share=0), rng, 6)
    np.testing.assert_array_equal(best.scores, scene.scores[:2, :6])
    other = make_sample(scene, 0, 1, MatchConfig(random_share=1), rng, 6)
    assert not np.array_equal(other.scores, best.scores)


def test_positions_turn_by_right_angles_about_the_centre():
    points = np.array([[0.5, 0.25]])
    np.testing.assert_array_equal([turned(points, k)[0] for k in range(4)],
                                  [[0.5, 0.25], [-0.25, 0.5], [-0.5, -0.25], [0.25, -0.5]])


def test_a_cache_without_scenes_is_refused(tmp_path):
    with pytest.raises(TrainingError, match="no scenes"):
        cached_scenes(tmp_path, 4, "cache_scenes")


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


def test_exported_network_equals_torch_at_any_count(tmp_path):
    network = trained_network()
    export_onnx(network, tmp_path / "g.onnx")
    assert check_export(network, tmp_path / "g.onnx") < 1e-3
    with torch.no_grad():
        network.matchable.bias += 1
    with pytest.raises(TrainingError, match="differs"):
        check_export(network, tmp_path / "g.onnx")


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
