import numpy as np
import pytest

from deepuav_training.config import from_mapping
from deepuav_training.data.faces import Face, halves, render_faces
from deepuav_training.data.render import Camera
from deepuav_training.data.rooms import (Box, RoomConfig, Viewpoint, camera_at, draw_viewpoint,
                                         make_room, other_viewpoint)
from deepuav_training.data.scenes import SceneConfig, make_scene, room_scene
from deepuav_training.errors import TrainingError
from scene_support import corresponding_values, smooth_texture

WIDTH, HEIGHT = 96, 72
SMALL = SceneConfig(views=4, width=WIDTH, height=HEIGHT, flat_share=0.0, room_share=1.0)
IDENTITY = Camera(np.array([[80, 0, 47.5], [0, 80, 35.5], [0, 0, 1]]), np.eye(3, 4), WIDTH, HEIGHT)


def plate(depth, half=10.0, texture=None, moving=False, tilt=0.0):
    """A square before the camera, whose right side is `tilt` farther for each metre."""
    texture = smooth_texture() if texture is None else texture
    corner = np.array([-half, -half, depth - tilt * half])
    return Face(corner, np.array([2 * half, 0, 2 * half * tilt]), np.array([0, 2 * half, 0]),
                halves(texture), moving)


def grid(step=4, border=4):
    x, y = np.meshgrid(np.arange(border, WIDTH - border, step),
                       np.arange(border, HEIGHT - border, step))
    return np.stack([x.ravel(), y.ravel()], axis=1).astype(float)


def test_depth_of_a_tilted_face_is_that_of_its_plane():
    seen = render_faces([plate(5.0, tilt=0.4)], IDENTITY)
    x = (grid()[:, 0] - 47.5) / 80
    columns, rows = grid().astype(int).T
    np.testing.assert_allclose(seen.depth[rows, columns], 5 / (1 - 0.4 * x), rtol=1e-5)


def test_a_face_shows_its_texture_where_it_is():
    ramp = np.tile(np.arange(200), (200, 1)).astype(np.uint8)
    seen = render_faces([plate(5.0, half=3.0, texture=ramp)], IDENTITY)
    x = 5 * (np.arange(WIDTH) - 47.5) / 80
    expected = (x + 3) / 6 * 200 - 0.5
    np.testing.assert_allclose(seen.image[30, :], np.clip(expected, 0, 199), atol=1)


def test_the_nearer_face_hides_the_other_whatever_their_order():
    near, far = plate(2.0, half=0.5, moving=True), plate(5.0)
    for faces in ([near, far], [far, near]):
        seen = render_faces(faces, IDENTITY)
        assert seen.depth[36, 48] == pytest.approx(2) and seen.depth[2, 2] == pytest.approx(5)
        assert seen.moving[36, 48] and not seen.moving[2, 2]


def test_faces_behind_the_camera_are_not_seen():
    seen = render_faces([plate(-2.0), plate(5.0)], IDENTITY)
    np.testing.assert_allclose(seen.depth, 5, rtol=1e-5)
    assert np.isinf(render_faces([plate(-2.0)], IDENTITY).depth).all()


def test_a_face_that_goes_past_the_camera_is_seen_in_front_only():
    floor = Face(np.array([-5, 1.0, -5]), np.array([10.0, 0, 0]), np.array([0, 0, 15.0]),
                 halves(smooth_texture()), False)
    seen = render_faces([floor], IDENTITY)
    row = 60
    np.testing.assert_allclose(seen.depth[row], 80 / (row - 35.5), rtol=1e-4)
    assert np.isinf(seen.depth[:35]).all()


def test_a_small_picture_of_a_fine_texture_does_not_alias():
    fine = np.tile([[0, 250], [250, 0]], (100, 100)).astype(np.uint8)
    seen = render_faces([plate(20.0, half=10.0, texture=fine)], IDENTITY)
    middle = seen.image[10:60, 20:76]
    assert abs(int(middle.min()) - 125) <= 2 and abs(int(middle.max()) - 125) <= 2


def test_clearance_is_along_the_axes_of_a_turned_box():
    box = Box(np.array([1.0, 0, -1]), np.array([2.0, 1, 1]), np.pi / 2)
    np.testing.assert_allclose(box.clearance(np.array([1.0, 2.5, -1])), [0.5, -1, -1], atol=1e-12)


def test_cameras_stand_free_and_look_at_their_target():
    config = RoomConfig()
    for seed in range(20):
        rng = np.random.default_rng(seed)
        room = make_room(smooth_texture(), smooth_texture(1), rng, config)
        first = draw_viewpoint(room, rng, config)
        for view in (first, other_viewpoint(first, room, rng, config)):
            assert room.is_free(view.place)
            camera = camera_at(view, 80, WIDTH, HEIGHT)
            np.testing.assert_allclose(camera.centre, view.place, atol=1e-9)
            ahead = camera.camera_from_world @ np.append(view.target, 1)
            np.testing.assert_allclose(ahead[:2], 0, atol=1e-9)
            assert ahead[2] > 0
            depth = render_faces(room.faces, camera).depth
            assert np.isfinite(depth).all() and depth.min() > 0.2


def test_an_upright_camera_has_the_floor_below():
    camera = camera_at(Viewpoint(np.array([0, 0, -1.0]), np.array([3, 1, -1.0]), 0.0), 80, WIDTH,
                       HEIGHT)
    down = camera.camera_from_world[:, :3] @ [0, 0, 1.0]
    np.testing.assert_allclose(down, [0, 1, 0], atol=1e-12)
    assert np.linalg.det(camera.camera_from_world[:, :3]) == pytest.approx(1)


def test_corresponding_points_of_a_room_look_alike():
    config = RoomConfig(texture_px_m=(10.0, 10.0), moving_max=0)
    rng = np.random.default_rng(3)
    room = make_room(smooth_texture(blur=8), smooth_texture(1, blur=8), rng, config)
    view = draw_viewpoint(room, rng, config)
    cameras = [camera_at(v, 80, WIDTH, HEIGHT)
               for v in (view, other_viewpoint(view, room, rng, config))]
    kept, values = corresponding_values(room.faces, cameras, grid(step=3))
    assert kept > 0.4
    assert np.median(np.abs(values[0] - values[1])) < 3
    assert np.median(np.abs(values[0] - np.roll(values[1], 7))) > 15


def test_rooms_repeat_with_their_seed_and_are_drawn_by_their_share():
    photos = smooth_texture(), smooth_texture(1)
    first, again = (room_scene(*photos, np.random.default_rng(9), SMALL) for _ in range(2))
    for a, b in zip(first.images, again.images, strict=True):
        assert a.shape == (HEIGHT, WIDTH) and np.array_equal(a, b)
    np.testing.assert_array_equal(first.transfer(grid(), 0, 2), again.transfer(grid(), 0, 2))
    scene = make_scene(*photos, [], np.random.default_rng(1), SMALL)  # no height map is needed
    assert len(scene.images) == 4


@pytest.mark.parametrize("tree, message", [
    ({"room_share": 0.8}, "room_share: found 0.8, expected a share of at most what"),
    ({"room": {"side_m": [1.0, 5.0]}}, "side_m: found 1.0, expected more than 1.6 m"),
    ({"room": {"boxes": [9, 3]}}, "boxes: found \\[9, 3\\]"),
])
def test_impossible_rooms_are_refused(tree, message):
    with pytest.raises(TrainingError, match=message):
        from_mapping(SceneConfig, tree, "scenes")
