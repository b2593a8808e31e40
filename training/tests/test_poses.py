import cv2
import numpy as np
import pytest

from deepuav_training.data.sequences import load_undistorted, read_sequence
from deepuav_training.errors import TrainingError
from deepuav_training.evaluate_poses import choose_pairs, pose_error_deg, relative_pose

FRAMES = 30


def write_tum(folder):
    (folder / "rgb").mkdir()
    (folder / "camera.yaml").write_text(
        "fx: 100.0\nfy: 100.0\ncx: 63.5\ncy: 47.5\ndistortion: []\n")
    frames, poses = ["# timestamp filename"], ["# timestamp tx ty tz qx qy qz qw"]
    for i in range(FRAMES):
        cv2.imwrite(str(folder / f"rgb/{i}.png"), np.full((96, 128), i, np.uint8))
        frames.append(f"{i}.0 rgb/{i}.png")
        half = 0.005 * i
        poses.append(f"{i}.0 {0.1 * i} 0 0 0 {np.sin(half)} 0 {np.cos(half)}")
    poses.pop()  # the last frame has no pose
    (folder / "rgb.txt").write_text("\n".join(frames))
    (folder / "groundtruth.txt").write_text("\n".join(poses))


def test_tum_sequence_is_read(tmp_path):
    write_tum(tmp_path)
    sequence = read_sequence(tmp_path, focal_px=90)
    assert len(sequence.files) == FRAMES - 1
    assert sequence.camera_matrix[0, 0] == 90 and sequence.camera_matrix[0, 2] == 63.5
    np.testing.assert_allclose(sequence.world_from_camera[20][:3, 3], [2, 0, 0])
    np.testing.assert_allclose(sequence.world_from_camera[20][0, 2], np.sin(0.2), atol=1e-9)
    image, matrix = load_undistorted(sequence, 7, 64)
    assert image.shape == (48, 64) and image[0, 0] == 7
    np.testing.assert_allclose(matrix[0], [45, 0, 31.5])
    pairs = choose_pairs(sequence, 8, 0)
    assert len(pairs) == 6 and all(b - a in (5, 10, 20) for a, b in pairs)


def test_no_sequence_is_an_error(tmp_path):
    with pytest.raises(TrainingError, match="rgb.txt"):
        read_sequence(tmp_path)


def test_pose_of_true_matches_is_found(tmp_path):
    write_tum(tmp_path)
    sequence = read_sequence(tmp_path)
    b_from_a = relative_pose(sequence, 0, 10)
    rng = np.random.default_rng(0)
    a = rng.uniform((-2, -1.5, 3), (2, 1.5, 8), (200, 3))
    b = a @ b_from_a[:3, :3].T + b_from_a[:3, 3]
    pixels = [(p @ sequence.camera_matrix.T)[:, :2] / p[:, 2:] for p in (a, b)]
    noisy = [p + rng.normal(0, 0.1, p.shape) for p in pixels]
    noisy[1][:40] += rng.uniform(-40, 40, (40, 2))
    assert pose_error_deg(*noisy, sequence.camera_matrix, b_from_a) < 1.5
    assert pose_error_deg(*noisy, sequence.camera_matrix, relative_pose(sequence, 10, 0)) > 20
    assert pose_error_deg(noisy[0][:4], noisy[1][:4], sequence.camera_matrix, b_from_a) == np.inf


def test_far_points_tell_a_pose_too():
    camera = np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]])
    rng = np.random.default_rng(1)
    b_from_a = np.eye(4)
    b_from_a[0, 3] = 0.5
    a = rng.uniform((-30, -20, 80), (30, 20, 120), (300, 3))  # 160 baselines away and farther
    b = a + b_from_a[:3, 3]
    pixels = [(p @ camera.T)[:, :2] / p[:, 2:] for p in (a, b)]
    noisy = [p + rng.normal(0, 0.02, p.shape) for p in pixels]
    assert pose_error_deg(*noisy, camera, b_from_a, "ransac") < 20
