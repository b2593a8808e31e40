import json
from dataclasses import asdict, replace

import cv2
import numpy as np
import pytest
import torch

from deepuav_training.classic import (OrbExtractor, SiftExtractor, hamming_nearest, ratio_nearest)
from deepuav_training.compare import Comparison, ComparisonConfig, line_key, narrowed
from deepuav_training.errors import TrainingError
from deepuav_training.evaluate import SETS, Pair, measure
from deepuav_training.export_superglue import export_onnx
from deepuav_training.learned_matchers import SuperGlueMatcher, mutual_best
from deepuav_training.methods import (MethodConfig, MethodOptions, RememberedExtractor,
                                      build_method, without_faint)
from deepuav_training.metrics import area_under_curve, mutual_nearest, paired_difference
from deepuav_training.models.superglue import SuperGlue, SuperGlueConfig
from deepuav_training.runtime import Features


def blocks(shift=(0, 0)):
    """A picture with many corners, moved by whole pixels."""
    rng = np.random.default_rng(0)
    coarse = rng.integers(0, 256, (24, 30)).astype(np.uint8)
    large = cv2.resize(coarse, (30 * 12, 24 * 12), interpolation=cv2.INTER_CUBIC)
    x, y = 40 - shift[0], 40 - shift[1]
    return np.ascontiguousarray(large[y:y + 200, x:x + 240])


def described(points, descriptors):
    count = len(points)
    return Features(np.asarray(points, np.float32), np.linspace(1, 0.1, count).astype(np.float32),
                    np.asarray(descriptors), (240, 200))


@pytest.mark.parametrize("name, matcher", [("sift", "ratio"), ("orb", "nearest")])
def test_classic_methods_find_a_shift(name, matcher):
    method = build_method(MethodConfig(name, name, matcher=matcher), MethodOptions(points=200))
    pair = Pair(blocks(), blocks((7, -4)), np.array([[1, 0, 7], [0, 1, -4], [0, 0, 1.0]]))
    found = measure(method, [pair], ("ransac", "lo-ransac"))
    assert set(found) == {"ransac", "lo-ransac"}
    for figures in found.values():
        assert figures["AUC@3"] > 80 and figures["precision"] > 80
        assert 20 < figures["points"] <= 200


@pytest.mark.parametrize("extractor", [SiftExtractor, OrbExtractor])
def test_images_without_structure_have_no_key_points(extractor):
    found = extractor(100)(np.full((80, 96), 127, np.uint8))
    assert found.points.shape == (0, 2) and len(found.descriptors) == 0
    match = ratio_nearest if extractor is SiftExtractor else hamming_nearest
    assert match(found, found).shape == (0, 2)


def test_ratio_rejects_what_is_ambiguous():
    points = [[10, 10], [20, 10], [30, 10]]
    a = described(points[:2], np.float32([[1, 0, 0], [0, 1, 0]]))
    b = described(points, np.float32([[1, 0.1, 0], [0.02, 1, 0], [-0.02, 1, 0]]))
    assert ratio_nearest(a, b).tolist() == [[0, 0]]


def test_assignments_must_be_mutual_and_probable():
    probability = np.array([[0.6, 0.1, 0.0], [0.5, 0.05, 0.0], [0.0, 0.0, 0.3], [0.0, 0.15, 0.0]])
    found = mutual_best(np.log(probability + 1e-9), 0.2)
    assert found.tolist() == [[0, 0], [2, 2]]


def test_new_superglue_matches_like_nearest_neighbours(tmp_path):
    torch.manual_seed(0)
    export_onnx(SuperGlue(SuperGlueConfig(descriptor=32, width=32, heads=2, layers=1, hidden=16)),
                tmp_path / "g.onnx")
    rng = np.random.default_rng(1)
    clean = rng.standard_normal((60, 32))
    views = []
    for count, order in ((60, np.arange(60)), (50, rng.permutation(50))):
        noisy = (clean + 0.1 * rng.standard_normal(clean.shape))[order]
        noisy /= np.linalg.norm(noisy, axis=1, keepdims=True)
        views.append(described(rng.uniform(0, 200, (count, 2)), noisy.astype(np.float32)))
    found = SuperGlueMatcher(tmp_path / "g.onnx", 1, "f32", 0.2)(*views)
    nearest = mutual_nearest(views[0].descriptors, views[1].descriptors)
    assert len(found) == 50
    assert set(map(tuple, found)) <= set(map(tuple, nearest))


def test_missing_and_unknown_methods_are_named(tmp_path):
    with pytest.raises(TrainingError, match="g.onnx"):
        SuperGlueMatcher(tmp_path / "g.onnx", 1, "f32", 0.2)
    with pytest.raises(TrainingError, match="surf"):
        ComparisonConfig(methods=({"name": "a", "extractor": "surf"},)).method_configs("c.yaml")


def test_features_are_extracted_once_and_fewer_are_the_best_of_more():
    seen = []

    def extractor(image):
        seen.append(image)
        values = np.arange(10, 0, -1, dtype=np.float32)
        return described(np.stack([values, values], axis=1), np.eye(10, dtype=np.float32))

    remembered = RememberedExtractor(extractor)
    image, other = np.zeros((8, 16), np.uint8), np.zeros((16, 8), np.uint8)
    many, few = remembered.best(7)(image), remembered.best(3)(image.copy())
    assert len(seen) == 1 and len(many.points) == 7
    np.testing.assert_array_equal(few.points, many.points[:3])
    assert few.descriptors.shape == (3, 10) and few.size == many.size
    remembered.best(3)(other)
    assert len(seen) == 2


@pytest.mark.parametrize("clear, kept", [(0, 4), (2, 4), (6, 6), (9, 9)])
def test_faint_key_points_fill_up_images_that_have_few(clear, kept):
    options = MethodOptions(threshold=0.005, faint_points=4)
    scores = np.where(np.arange(9) < clear, 0.01, 0.002).astype(np.float32)
    seen = Features(np.zeros((9, 2), np.float32), scores, np.zeros((9, 8), np.float32), (16, 8))
    assert len(without_faint(seen, options).points) == kept


@pytest.fixture(name="photographs")
def photograph_folder(tmp_path):
    (tmp_path / "images/natural").mkdir(parents=True)
    lines = ["file\tsource_repo\toriginal_path"]
    for i in range(2):
        cv2.imwrite(str(tmp_path / f"images/natural/a_{i}.png"), blocks((3 * i, 2 * i)))
        lines.append(f"natural/a_{i}.png\trepo\ta/{i}.png")
    (tmp_path / "images/MANIFEST.tsv").write_text("\n".join(lines))
    (tmp_path / "labels.yaml").write_text(
        f"images: {tmp_path}/images\nsplit: {{validation_places: [a]}}\n")
    return tmp_path


def test_comparison_fills_tables_and_keeps_figures(photographs):
    methods = ({"name": "SIFT", "extractor": "sift", "matcher": "ratio"},)
    config = ComparisonConfig(methods=methods, labels=str(photographs / "labels.yaml"),
                              homography_pairs=2, points=(100,))
    kept = photographs / "out.json"
    comparison = Comparison(config, kept)
    (method,) = config.method_configs("")
    comparison.measure(method, 100)
    keys = {name: line_key(method, config, 100, name) for name in config.estimators}
    figures = json.loads(kept.read_text())[keys["ransac"]]
    assert set(figures) == set(SETS) and figures["easy"]["AUC@5"] > 50
    assert "| SIFT |" in comparison.table([method], 100, "lo-ransac")

    figures["easy"]["AUC@5"] = -1.0
    kept.write_text(json.dumps({key: figures for key in keys.values()}))
    again = Comparison(config, kept)
    again.measure(method, 100)  # nothing is missing
    assert again.results[keys["ransac"]]["easy"]["AUC@5"] == -1


def test_comparison_of_poses_alone(photographs):
    """A camera that moves sidewards before a wall: 4 pixels a frame."""
    sequence = photographs / "wall"
    (sequence / "rgb").mkdir(parents=True)
    (sequence / "camera.yaml").write_text("fx: 200.0\nfy: 200.0\ncx: 119.5\ncy: 99.5\n"
                                          "distortion: []\n")
    for i in range(8):
        cv2.imwrite(str(sequence / f"rgb/{i}.png"), blocks((-4 * i, 0)))
    (sequence / "rgb.txt").write_text("".join(f"{i}.0 rgb/{i}.png\n" for i in range(8)))
    (sequence / "groundtruth.txt").write_text(
        "".join(f"{i}.0 {0.04 * i} 0 0 0 0 0 1\n" for i in range(8)))
    sift = {"extractor": "sift", "matcher": "ratio"}
    config = ComparisonConfig(methods=({"name": "SIFT"} | sift, {"name": "again"} | sift),
                              labels=str(photographs / "labels.yaml"), sequences=(str(sequence),),
                              homography_pairs=0, pose_pairs=8, long_side=240, baseline="SIFT")
    comparison = Comparison(config, photographs / "out.json")
    methods = config.method_configs("")
    for method in methods:
        comparison.measure(method, 200)
    header, _, line, _ = comparison.table(methods, 200, "ransac").splitlines()[2:]
    assert header == "| method | wall |"
    assert line.startswith("| SIFT | ") and line.count("|") == 3
    *_, line = comparison.difference_table(methods, 200, "ransac").splitlines()
    assert line == f"| again | {', '.join(['+0.0 (+0.0 to +0.0)'] * 3)} |"


def test_differences_of_pairs_tell_chance_from_more():
    rng = np.random.default_rng(3)
    pairs = rng.uniform(0, 8, 400)  # easy ones and hard ones, which a method hardly changes
    found = {gain: paired_difference(pairs - gain + rng.normal(0, 0.3, 400), pairs, 10.0, 0)
             for gain in (0.0, 0.2)}
    for gain, (difference, low, high) in found.items():
        assert low < 0.1 * gain < high and low < difference < high and high - low < 0.02
    assert found[0.0][1] < 0 < found[0.2][1]


def test_pairs_without_a_pose_count_in_differences():
    found = paired_difference([1.0, np.inf, np.inf], [np.inf, np.inf, np.inf], 10.0, 0)
    assert found[0] == area_under_curve([1.0, np.inf, np.inf], 10.0) and found[1] == 0


def test_comparison_of_no_number_of_pairs_is_an_error():
    with pytest.raises(TrainingError, match="homography_pairs"):
        ComparisonConfig(methods=({},), homography_pairs=-1).check("c.yaml")


def test_baseline_that_is_not_compared_is_an_error():
    with pytest.raises(TrainingError, match="baseline.*ORB.*SIFT"):
        ComparisonConfig(methods=({"name": "SIFT"},), baseline="ORB").method_configs("c.yaml")


def test_a_comparison_is_narrowed_to_methods_and_a_baseline():
    config = ComparisonConfig(methods=({"name": "SIFT"}, {"name": "ORB"}, {"name": "XFeat"}),
                              baseline="SIFT")
    assert narrowed(config, None, None) == config
    two = narrowed(config, ["XFeat", "ORB"], "ORB")
    assert [m["name"] for m in two.methods] == ["ORB", "XFeat"] and two.baseline == "ORB"
    with pytest.raises(TrainingError, match="--only.*AKAZE.*SIFT, ORB, XFeat"):
        narrowed(config, ["AKAZE"], None)
    with pytest.raises(TrainingError, match="baseline.*SIFT.*ORB"):
        narrowed(config, ["ORB"], None).method_configs("c.yaml")


def test_figures_of_another_network_or_setting_are_not_taken(photographs):
    network = photographs / "network.onnx"
    network.write_bytes(b"first")
    method = MethodConfig("net", model=str(network))
    config = ComparisonConfig(methods=(asdict(method),), labels=str(photographs / "labels.yaml"))
    key = line_key(method, config, 100, "ransac")
    assert key == line_key(method, config, 100, "ransac")
    assert key != line_key(method, replace(config, seed=12), 100, "ransac")
    network.write_bytes(b"second")
    assert key != line_key(method, config, 100, "ransac")
