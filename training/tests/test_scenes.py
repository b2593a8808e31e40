import cv2
import numpy as np
import pytest

from deepuav_training.data.photometric import PhotometricConfig
from deepuav_training.data.render import Terrain, render, visible_points, world_points
from deepuav_training.data.scenes import SceneConfig, flat_scene, make_scene, terrain_scene
from deepuav_training.data.terrain import Pose, look_at, read_height_maps
from deepuav_training.errors import TrainingError
from scene_support import smooth_texture, values_at

SIZE = 200
SMALL = SceneConfig(views=3, width=96, height=72)
SHARP = PhotometricConfig(clean_share=1.0)


def terrain(heights=None, moving=None, cell=1.0):
    heights = np.zeros((SIZE, SIZE), np.float32) if heights is None else heights
    moving = np.zeros((SIZE, SIZE), np.uint8) if moving is None else moving
    return Terrain(heights, cell, smooth_texture(), np.ones((SIZE, SIZE), np.float32), moving,
                   smooth_texture(1))


def camera(x=100.0, y=100.0, tilt=0.0, direction=0.0, scale=1.0):
    return look_at(Pose(np.array([x, y]), 0.0, tilt, direction, scale), 0.0, 100.0, 96, 72)


def grid(step=8, border=8):
    x, y = np.meshgrid(np.arange(border, 96 - border, step), np.arange(border, 72 - border, step))
    return np.stack([x.ravel(), y.ravel()], axis=1).astype(float)


def tower(height=30.0):
    heights = np.zeros((SIZE, SIZE), np.float32)
    heights[90:110, 100:110] = height
    return heights


def test_level_ground_seen_from_above():
    seen = render(terrain(), camera())
    np.testing.assert_allclose(seen.depth, 100, rtol=1e-4)
    window = smooth_texture()[64:136, 52:148].astype(float)  # the centre lies between pixels
    shifted = cv2.warpAffine(window, np.float32([[1, 0, 0.5], [0, 1, 0.5]]), (96, 72),
                             flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
    assert np.abs(seen.image[1:-1, 1:-1] - shifted[1:-1, 1:-1]).max() <= 3


def test_a_texture_of_odd_size_stays_in_place_where_it_is_made_smaller():
    ramp = np.tile(np.arange(121) * 2, (121, 1)).astype(np.uint8)
    level = np.zeros((121, 121), np.float32)
    ground = Terrain(level, 1.0, ramp, level + 1, level.astype(np.uint8), ramp)
    view = camera(80, 60, scale=0.5)
    seen = render(ground, view)
    points = grid(step=4)
    world = world_points(seen, view, points)
    inside = (world[:, 0] > 3) & (world[:, 0] < 117)
    columns, rows = points[inside].astype(int).T
    np.testing.assert_allclose(seen.image[rows, columns], 2 * world[inside, 0], atol=1)
    assert inside.sum() > 40


def test_depth_of_a_tilted_view_is_that_of_the_plane():
    view = camera(tilt=0.6, direction=0.3)
    seen = render(terrain(), view)
    world = world_points(seen, view, grid())
    np.testing.assert_allclose(world[:, 2], 0, atol=0.02)


def test_roof_is_nearer_and_its_wall_hides_the_ground():
    heights = tower()
    above, slanted = camera(), camera(x=90.0, tilt=0.7, direction=-np.pi / 2)
    assert slanted.centre[0] < 60  # looks towards +x, the tower between
    ground, view = render(terrain(heights), above), render(terrain(heights), slanted)
    assert abs(ground.depth[36, 53] - 70) < 0.1 and abs(ground.depth[36, 20] - 100) < 0.1
    behind, roof, before = (np.array([[x, 100.0, -z]]) for x, z in ((112, 0), (105, 30), (85, 0)))
    pixels = visible_points(view, slanted, np.concatenate([behind, roof, before]))
    assert np.isnan(pixels[0]).all() and np.isfinite(pixels[1:]).all()


def test_moving_things_are_not_where_they_were():
    moving = np.zeros((SIZE, SIZE), np.uint8)
    moving[90:110, 90:110] = 1
    before, after = camera(), camera(x=103.0)
    first, second = render(terrain(), before), render(terrain(moving=moving), after)
    world = world_points(first, before, np.array([[48.0, 36.0], [10.0, 10.0]]))
    pixels = visible_points(second, after, world)
    assert np.isnan(pixels[0]).all()
    np.testing.assert_allclose(pixels[1], [7, 10], atol=0.02)
    assert second.moving.sum() == pytest.approx(400, rel=0.1)


def test_corresponding_points_of_a_terrain_look_alike():
    heights = cv2.GaussianBlur(tower(), (0, 0), 6)
    views = [camera(tilt=0.3, direction=1.0), camera(x=92.0, tilt=0.5, direction=2.0, scale=1.2)]
    seen = [render(terrain(heights), view) for view in views]
    points = grid(step=3)
    moved = visible_points(seen[1], views[1], world_points(seen[0], views[0], points))
    kept = np.isfinite(moved).all(axis=1)
    assert kept.mean() > 0.5
    values = [values_at(s.image, p) for s, p in zip(seen, (points[kept], moved[kept]), strict=True)]
    assert np.abs(values[0] - values[1]).mean() < 3
    assert np.abs(values[0] - np.roll(values[1], 7)).mean() > 15


def test_flat_scene_has_no_points_off_the_photograph():
    scene = flat_scene(smooth_texture(size=80), np.random.default_rng(2), SMALL)
    corners = np.array([[0.0, 0], [95, 0], [0, 71], [95, 71]])
    assert any(np.isnan(scene.transfer(corners, 0, b)).any() for b in (1, 2))
    same = scene.transfer(grid(), 1, 1)
    kept = np.isfinite(same).all(axis=1)
    np.testing.assert_allclose(same[kept], grid()[kept], atol=1e-6)


@pytest.mark.parametrize("make", [flat_scene, None])
def test_transfer_there_and_back_again(make):
    rng = np.random.default_rng(4)
    maps = [np.random.default_rng(5).random((60, 60)).astype(np.float32)]
    photo = smooth_texture()
    scene = (make(photo, rng, SMALL) if make
             else terrain_scene(photo, smooth_texture(1), maps, rng, SMALL))
    there = scene.transfer(grid(), 0, 1)
    kept = np.isfinite(there).all(axis=1)
    assert kept.sum() > 5
    back = scene.transfer(there[kept], 1, 0)
    error = np.linalg.norm(back - grid()[kept], axis=1)
    assert np.nanmedian(error) < 0.1


def test_scenes_repeat_with_their_seed():
    maps = [np.random.default_rng(5).random((60, 60)).astype(np.float32)]
    photo, paint = smooth_texture(), smooth_texture(1)
    first, again = (make_scene(photo, paint, maps, np.random.default_rng(9), SMALL)
                    for _ in range(2))
    for a, b in zip(first.images, again.images, strict=True):
        assert a.shape == (72, 96) and np.array_equal(a, b)
    np.testing.assert_array_equal(first.transfer(grid(), 0, 2), again.transfer(grid(), 0, 2))


def test_height_maps_must_have_16_bits(tmp_path):
    with pytest.raises(TrainingError, match="no \\*.png"):
        read_height_maps(tmp_path)
    cv2.imwrite(str(tmp_path / "a.png"), np.full((4, 4), 65535, np.uint16))
    assert read_height_maps(tmp_path)[0].max() == 1
    cv2.imwrite(str(tmp_path / "b.png"), np.zeros((4, 4), np.uint8))
    with pytest.raises(TrainingError, match="b.png"):
        read_height_maps(tmp_path)
