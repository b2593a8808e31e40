import dataclasses
from pathlib import Path

import numpy as np
import pytest

from deepuav_training import label_scenes, train_superpoint
from deepuav_training.adaptation import AdaptationConfig
from deepuav_training.config import from_mapping
from deepuav_training.data.pairs import PairConfig
from deepuav_training.data.photometric import PhotometricConfig
from deepuav_training.data.scene_pairs import (ScenePairConfig, ScenePairSource, choose_pair,
                                               mixed_draw)
from deepuav_training.data.scenes import Scene, SceneConfig, room_scene
from deepuav_training.errors import TrainingError
from deepuav_training.keypoints import CELL
from deepuav_training.label import LabelConfig
from deepuav_training.label_cache import Labels
from deepuav_training.label_scenes import LabelScenesConfig, label_scene, labelled_identity
from deepuav_training.labelled_scenes import (LabelledScene, load_labelled_scene, relate,
                                              save_labelled_scene, shared_cells)
from scene_support import smooth_texture, values_at

WIDTH, HEIGHT, BORDER = 160, 120, 6
ROOM = SceneConfig(views=4, width=WIDTH, height=HEIGHT)
SHARP = PairConfig(photometric=PhotometricConfig(clean_share=1.0))


def room(seed=0):
    return room_scene(smooth_texture(0), smooth_texture(1), np.random.default_rng(seed), ROOM)


def random_labels(seed, count=150):
    rng = np.random.default_rng(seed)
    descriptors = rng.standard_normal((count, 16)).astype(np.float32)
    descriptors /= np.linalg.norm(descriptors, axis=1, keepdims=True)
    points = rng.uniform(BORDER, (WIDTH - 1 - BORDER, HEIGHT - 1 - BORDER), (count, 2))
    return Labels(points.astype(np.float32), rng.uniform(0.1, 1, count).astype(np.float32),
                  descriptors)


def labelled_room(seed=0):
    return relate(room(seed), [random_labels(k, 150 + k) for k in range(ROOM.views)], BORDER)


def shifted_scene(shift):
    """Two views of which the second shows everything `shift` pixels farther to the right."""

    def transfer(points, a, b):
        moved = points + ((b - a) * shift, 0)
        inside = ((moved >= 0) & (moved <= (WIDTH - 1, HEIGHT - 1))).all(axis=1)
        return np.where(inside[:, None], moved, np.nan)

    return Scene([np.zeros((HEIGHT, WIDTH), np.uint8)] * 2, transfer)


def test_cells_that_the_labelled_view_does_not_show_wholly_are_not_shared():
    shared = shared_cells(shifted_scene(20.0), 1, 0, WIDTH, HEIGHT, 0)
    assert not shared[:, :3].any()  # up to pixel 23 a corner lies left of the first view's edge
    assert shared[:, 3:].all()
    bordered = shared_cells(shifted_scene(20.0), 1, 0, WIDTH, HEIGHT, BORDER)
    assert not bordered[:, 3].any() and not bordered[0].any() and bordered[1:-1, 4:-1].all()


def test_a_cell_that_is_hidden_in_its_middle_is_not_shared():
    def transfer(points, a, b):
        hidden = np.abs(points - (3.5 * CELL - 0.5, 2.5 * CELL - 0.5)).max(axis=1) < 1
        return np.where(hidden[:, None], np.nan, points)

    scene = Scene([np.zeros((HEIGHT, WIDTH), np.uint8)] * 2, transfer)
    assert np.argwhere(~shared_cells(scene, 0, 1, WIDTH, HEIGHT, 0)).tolist() == [[2, 3]]


def test_scenes_come_back_whole(tmp_path):
    scene = labelled_room()
    save_labelled_scene(tmp_path / "a.npz", scene)
    loaded = load_labelled_scene(tmp_path / "a.npz")
    np.testing.assert_array_equal(loaded.images, scene.images)
    np.testing.assert_array_equal(loaded.shared, scene.shared)
    for a, labels in enumerate(scene.labels):
        np.testing.assert_array_equal(loaded.labels[a].points, labels.points)
        np.testing.assert_allclose(loaded.labels[a].mass, labels.mass, atol=1e-3)
        assert (loaded.labels[a].descriptors * labels.descriptors).sum(axis=1).min() > 0.99
        for b in range(ROOM.views):
            np.testing.assert_array_equal(loaded.seen_at[a][b], scene.seen_at[a][b])


@pytest.mark.parametrize("kept", [0, 3, 2000, -30])
def test_a_scene_cut_short_is_named(tmp_path, kept):
    path = tmp_path / "000007.npz"
    save_labelled_scene(path, labelled_room())
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(TrainingError, match=path.name):
        load_labelled_scene(path)


def test_samples_show_the_same_places_in_both_views(tmp_path):
    source = source_of(tmp_path, 3)
    differences, counts = [], []
    for number in range(12):
        sample = source.draw(number)
        at = sample.points[:, : sample.count].astype(float)
        a, b = (values_at(image, points)[:, 0] for image, points in zip(sample.images, at))
        differences.append(np.abs(a - b))
        counts.append(sample.count)
        assert (at >= BORDER).all() and (at <= (WIDTH - 1 - BORDER, HEIGHT - 1 - BORDER)).all()
    assert min(counts) > 20
    assert np.median(np.concatenate(differences)) < 4  # of 255; edges of boxes differ


def test_cells_that_are_known_hold_the_labels_that_are_seen(tmp_path):
    source = source_of(tmp_path, 2)
    for number in range(6):
        sample = source.draw(number)
        column, row = np.rint(sample.points[1, : sample.count]).astype(int).T // CELL
        known = sample.known[1][row, column]
        assert known.any()
        assert (sample.cells[1][64][row, column][known] < 1).all()


def test_known_are_the_cells_of_the_second_view_that_the_first_one_shows(tmp_path):
    scene = relate(shifted_scene(20.0), [random_labels(k) for k in range(2)], 0)
    assert not scene.shared[0, 1][:, :3].any() and scene.shared[0, 1][:, 3:].all()
    assert not scene.shared[1, 0][:, -3:].any() and scene.shared[1, 0][:, :-3].all()
    save_labelled_scene(tmp_path / "0.npz", scene)
    source = ScenePairSource([tmp_path / "0.npz"], 30, SHARP, 4)
    drawn = set()
    for number in range(8):
        sample = source.draw(number)
        a = 0 if sample.points[1, 0, 0] > sample.points[0, 0, 0] else 1
        drawn.add(a)
        np.testing.assert_array_equal(sample.known[1], scene.shared[a, 1 - a])
    assert drawn == {0, 1}


def test_a_view_is_never_paired_with_itself_or_with_one_that_shows_too_little():
    scene = labelled_room()
    counts = scene.counts()
    least = int(np.median(counts[counts > 0]))
    pairs = {choose_pair(scene, least, np.random.default_rng(seed)) for seed in range(60)}
    assert pairs == {(a, b) for a, b in np.argwhere(counts >= least).tolist()}
    assert all(a != b for a, b in pairs)


def test_a_scene_with_too_little_in_common_gives_its_best_pair():
    scene = labelled_room()
    counts = scene.counts()
    a, b = choose_pair(scene, 10000, np.random.default_rng(0))
    assert counts[a, b] == counts.max()


def test_a_sample_depends_on_its_number_alone(tmp_path):
    first, again = source_of(tmp_path, 3), source_of(tmp_path, 3)
    first.draw(0)
    for one, other in zip(dataclasses.astuple(first.draw(5)), dataclasses.astuple(again.draw(5)),
                          strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("share", [0.5, 0.3, 0.8])
def test_both_kinds_are_drawn_in_their_shares_and_in_order(share):
    class Recorder:
        def __init__(self):
            self.numbers = []

        def draw(self, number):
            self.numbers.append(number)

    flat, scenes = Recorder(), Recorder()
    draw = mixed_draw(flat, scenes, share)
    for number in range(1000):
        draw(number)
    assert scenes.numbers == list(range(len(scenes.numbers)))
    assert flat.numbers == list(range(len(flat.numbers)))
    assert abs(len(scenes.numbers) - 1000 * share) <= 1


def test_labels_are_the_teachers_and_scenes_without_anything_in_common_are_left_out():
    config = LabelScenesConfig(least_shared=1, adaptation=AdaptationConfig(homographies=0))

    def teacher(image):
        logits = np.full((65, HEIGHT // CELL, WIDTH // CELL), -8, np.float32)
        logits[64] = 0
        logits[27, 3:-3, 3:-3] = 4  # a point in the middle of each cell
        descriptors = np.ones((16, *logits.shape[1:]), np.float32)
        return logits, descriptors

    found = label_scene(shifted_scene(16.0), teacher, config, np.random.default_rng(0))
    assert len(found.labels[0].points) == (HEIGHT // CELL - 6) * (WIDTH // CELL - 6)
    np.testing.assert_allclose(found.seen_at[0][1] - found.labels[0].points, [[16, 0]] * len(
        found.labels[0].points))
    assert label_scene(shifted_scene(1000.0), teacher, config, np.random.default_rng(0)) is None


def test_a_scene_with_a_view_without_any_point_is_left_out():
    def blind(image):
        logits = np.full((65, HEIGHT // CELL, WIDTH // CELL), -8, np.float32)
        logits[64] = 8
        return logits, np.ones((16, *logits.shape[1:]), np.float32)

    config = LabelScenesConfig(least_shared=1, adaptation=AdaptationConfig(homographies=0))
    assert label_scene(room(), blind, config, np.random.default_rng(0)) is None


def test_the_teacher_is_not_needed_to_read_its_labels(monkeypatch):
    config = dataclasses.replace(LabelScenesConfig(), teacher="missing.onnx")
    monkeypatch.setattr(label_scenes, "photographs_identity", lambda images, split: {})
    monkeypatch.setattr(label_scenes, "load_config", lambda kind, path: kind())
    assert labelled_identity(config) == labelled_identity(LabelScenesConfig())


def test_views_that_are_degraded_already_are_refused():
    with pytest.raises(TrainingError, match="clean_share.*0.2.*1"):
        from_mapping(LabelScenesConfig, {"scene": {"photometric": {"clean_share": 0.2}}}, "x.yaml")


def test_scenes_of_another_size_than_the_labelled_views_are_refused(monkeypatch):
    scene = dataclasses.replace(LabelScenesConfig().scene, width=480, height=360)
    loaded = {LabelScenesConfig: dataclasses.replace(LabelScenesConfig(), scene=scene),
              LabelConfig: LabelConfig()}
    monkeypatch.setattr(train_superpoint, "load_config", lambda kind, path: loaded[kind])
    monkeypatch.setattr(train_superpoint, "check_claim", lambda folder, identity: {})
    monkeypatch.setattr(train_superpoint, "label_identity", lambda labels: {})
    monkeypatch.setattr(train_superpoint, "labelled_identity", lambda scenes: {})
    monkeypatch.setattr(train_superpoint, "training_views", lambda labels: [])
    monkeypatch.setattr(train_superpoint, "PairSource", lambda *arguments: [])
    config = train_superpoint.TrainConfig(rendered=ScenePairConfig(scenes="scenes.yaml"))
    with pytest.raises(TrainingError, match="scenes.yaml.*480.*360"):
        train_superpoint.samples(config)


def source_of(folder: Path, count: int) -> ScenePairSource:
    paths = [folder / f"{k}.npz" for k in range(count)]
    for seed, path in enumerate(paths):
        save_labelled_scene(path, labelled_room(seed))
    return ScenePairSource(paths, 30, SHARP, 4)
