import numpy as np
import pytest

from deepuav_training.adaptation import AdaptationConfig, adapt
from deepuav_training.config import from_mapping
from deepuav_training.cache_identity import check_claim, claim
from deepuav_training.data.homography import translation_matrix
from deepuav_training.data.manifest import Photograph, SplitConfig, split_photographs
from deepuav_training.data.pairs import PairConfig, PairSource, cell_labels, known_cells, nearest_points
from deepuav_training.data.views import View, ViewConfig
from deepuav_training.errors import TrainingError, telling_errors
from deepuav_training.keypoints import DetectionConfig, detect, probability_map
from deepuav_training.label import LabelConfig, part_of
from deepuav_training.label_cache import Labels, label_path, load_labels, save_labels


def logits_of(cells):
    return np.log(np.maximum(cells, 1e-9))


def test_labels_of_cells_sum_to_one():
    rng = np.random.default_rng(0)
    points = rng.uniform(-5, 70, (300, 2))  # crowded, and some outside
    cells = cell_labels(points, rng.uniform(0, 1, 300), 64, 48, 0.6)
    assert cells.shape == (65, 6, 8)
    np.testing.assert_allclose(cells.sum(axis=0), 1, atol=1e-5)
    assert cells.min() >= 0


def test_mass_is_spread_across_the_cells_border():
    cells = cell_labels(np.array([[15.5, 11.0]]), np.array([0.8]), 64, 48, 0.6)
    seen = 1 - cells[64]
    assert abs(seen.sum() - 0.8) < 1e-5
    assert abs(seen[1, 1] - 0.4) < 1e-3 and abs(seen[1, 2] - 0.4) < 1e-3  # the Gaussian is cut off


def test_no_points_means_no_point_anywhere():
    cells = cell_labels(np.zeros((0, 2)), np.zeros(0), 64, 48, 0.6)
    assert np.all(cells[64] == 1)


@pytest.mark.parametrize("point", [(20.0, 20.0), (21.3, 18.6), (23.5, 16.45)])
def test_detection_finds_labels_again_between_pixels(point):
    cells = cell_labels(np.array([point]), np.array([0.9]), 64, 48, 0.6)
    found, scores = detect(probability_map(logits_of(cells)), DetectionConfig())
    assert len(found) == 1 and scores[0] > 0.1
    np.testing.assert_allclose(found[0], point, atol=0.06)


def test_cells_outside_the_labelled_view_are_unknown():
    known = known_cells(translation_matrix((16.0, 0.0)), 64, 48, 0)
    assert not known[:, :2].any() and known[:, 2:].all()
    assert not known_cells(np.eye(3), 64, 48, 6)[0].any()


def test_pixels_know_which_point_is_nearest():
    points = np.array([[10.2, 10.0], [20.4, 10.0], [10.0, 30.0], [-5.0, 10.0], [np.nan, 3.0]])
    nearest = nearest_points(points, 64, 48)
    rows, columns = np.mgrid[:48, :64]
    distance = np.hypot(columns[..., None] - np.rint(points[:3, 0]), rows[..., None] - points[:3, 1])
    clear = np.ptp(np.sort(distance, axis=2)[..., :2], axis=2) > 1.5
    numbers = nearest[[10, 10, 30], [10, 20, 10]]
    assert len(set(numbers)) == 3
    np.testing.assert_array_equal(nearest[clear], numbers[distance.argmin(axis=2)][clear])


def test_pixels_of_a_view_without_points_are_all_alike():
    assert len(np.unique(nearest_points(np.zeros((0, 2)), 64, 48))) == 1


def test_no_labelled_view_is_an_error_that_names_folder_and_command(tmp_path):
    views = [View(0, Photograph("a.jpg", "s", "p"), np.eye(3))]
    with pytest.raises(TrainingError, match=f"{tmp_path}.* 1 views.*deepuav_training.label"):
        PairSource(views, tmp_path, tmp_path, ViewConfig(), PairConfig(), 1)


def test_parts_share_the_views_evenly():
    assert part_of(list(range(7)), "1/1") == list(range(7))
    parts = [part_of(list(range(7)), f"{k}/3") for k in (1, 2, 3)]
    assert sorted(sum(parts, [])) == list(range(7)) and parts[1] == [1, 4]


@pytest.mark.parametrize("part", ["0/2", "3/2", "1", "a/b", "1/0", "-1/2"])
def test_a_part_that_is_none_is_named(part):
    with pytest.raises(TrainingError, match=f"--part.*{part}"):
        part_of([], part)


def test_a_cache_of_other_photographs_is_refused(tmp_path):
    claim(tmp_path / "cache", {"split": {"places": ("a", "b")}, "seed": 1})
    claim(tmp_path / "cache", {"split": {"places": ("a", "b")}})
    claim(tmp_path / "cache", {"split": {"places": ("a", "b")}, "teacher": "x"})
    check_claim(tmp_path / "cache", {"teacher": "x", "not noted": 1})
    check_claim(tmp_path / "another", {"seed": 1})
    assert not (tmp_path / "another").exists()
    with pytest.raises(TrainingError, match="teacher x.*y"):
        claim(tmp_path / "cache", {"teacher": "y"})
    with pytest.raises(TrainingError, match=f"{tmp_path}/cache.*seed 1.*2"):
        claim(tmp_path / "cache", {"seed": 2})
    with pytest.raises(TrainingError, match="split"):
        claim(tmp_path / "cache", {"split": {"places": ("a",)}})


def test_cached_labels_come_back(tmp_path):
    rng = np.random.default_rng(0)
    descriptors = rng.standard_normal((7, 256)).astype(np.float32)
    descriptors /= np.linalg.norm(descriptors, axis=1, keepdims=True)
    labels = Labels(rng.uniform(0, 60, (7, 2)).astype(np.float32),
                    rng.uniform(0, 1, 7).astype(np.float32), descriptors)
    save_labels(label_path(tmp_path, 1234), labels)
    loaded = load_labels(tmp_path / "001" / "001234.npz")
    np.testing.assert_array_equal(loaded.points, labels.points)
    np.testing.assert_allclose(loaded.mass, labels.mass, atol=1e-3)
    assert (loaded.descriptors * descriptors).sum(axis=1).min() > 0.99


def test_broken_labels_are_named(tmp_path):
    path = tmp_path / "000000.npz"
    path.write_bytes(b"no archive")
    with pytest.raises(TrainingError, match="000000.npz"):
        load_labels(path)


def test_adaptation_recovers_what_a_teacher_sees_in_every_view():
    image = np.zeros((96, 128), np.uint8)
    corners = np.array([[40.0, 30.0], [88.0, 62.0], [60.0, 70.0]])
    for x, y in corners.astype(int):
        image[y - 2 : y + 3, x - 2 : x + 3] = 255

    def teacher(view):
        height, width = view.shape
        count, _, _, centres = _components(view)
        points = centres[1:count]
        cells = cell_labels(points, np.full(len(points), 0.9), width, height, 0.6)
        descriptors = np.zeros((8, height // 8, width // 8), np.float32)
        descriptors[0] = 1
        return logits_of(cells), descriptors

    labels = adapt(image, teacher, AdaptationConfig(homographies=5), np.random.default_rng(3))
    strong = labels.points[labels.mass > 0.3]
    assert len(strong) == len(corners)
    distance = np.linalg.norm(strong[:, None] - corners[None], axis=2)
    assert distance.min(axis=0).max() < 0.5
    np.testing.assert_allclose(np.linalg.norm(labels.descriptors, axis=1), 1, atol=1e-5)


def _components(view):
    import cv2
    return cv2.connectedComponentsWithStats((view > 60).astype(np.uint8))


def test_no_place_is_in_both_parts():
    photos = [Photograph(f"aerial/s{i % 3}_{i}.jpg", f"s{i % 3}", f"place{i % 17}")
              for i in range(100)]
    config = SplitConfig(validation_places=("place4",), validation_share=0.2)
    training, validation = split_photographs(photos, config)
    assert len(training) + len(validation) == 100 and training and validation
    assert not {p.place for p in training} & {p.place for p in validation}
    assert "place4" in {p.place for p in validation}


def test_unknown_keys_are_named():
    with pytest.raises(TrainingError, match="did you mean 'cache'"):
        from_mapping(LabelConfig, {"cach": "x"}, "labels.yaml")
    with pytest.raises(TrainingError, match="threads"):
        from_mapping(LabelConfig, {"threads": "two"}, "labels.yaml")


def test_a_label_file_cut_short_is_named(tmp_path):
    path = label_path(tmp_path, 7)
    save_labels(path, Labels(np.zeros((3, 2), np.float32), np.ones(3, np.float32),
                             np.eye(3, 256, dtype=np.float32)))
    whole = path.read_bytes()
    for kept in (0, 3, len(whole) // 2, len(whole) - 30):
        path.write_bytes(whole[:kept])
        with pytest.raises(TrainingError, match=path.name):
            load_labels(path)


def test_a_command_tells_an_error_in_one_line():
    @telling_errors
    def main() -> None:
        raise TrainingError("x.yaml: steps is 0, expected at least 1")

    with pytest.raises(SystemExit, match="^error: x.yaml: steps is 0, expected at least 1$"):
        main()
