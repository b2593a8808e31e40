import numpy as np
import pytest

from deepuav_training.config import from_mapping
from deepuav_training.data.faces import render_faces
from deepuav_training.data.render import visible_points, world_points
from deepuav_training.data.rooms import camera_at
from deepuav_training.data.scenes import SceneConfig, make_scene, street_scene
from deepuav_training.data.streets import (StreetConfig, draw_look, make_street, next_look,
                                           passing_faces)
from deepuav_training.errors import TrainingError
from scene_support import corresponding_values, smooth_texture

WIDTH, HEIGHT = 96, 72
SMALL = SceneConfig(views=3, width=WIDTH, height=HEIGHT, flat_share=0.0, street_share=1.0)


def grid(step=4, border=4):
    x, y = np.meshgrid(np.arange(border, WIDTH - border, step),
                       np.arange(border, HEIGHT - border, step))
    return np.stack([x.ravel(), y.ravel()], axis=1).astype(float)


def street_of(seed, config=StreetConfig()):
    rng = np.random.default_rng(seed)
    return make_street(smooth_texture(), smooth_texture(1), rng, config), rng


def test_cameras_stand_free_between_the_houses_and_look_along_the_street():
    config = StreetConfig(yaw_deg=25.0)
    for seed in range(10):
        street, rng = street_of(seed, config)
        first = draw_look(street, rng, config)
        assert abs(first.place[1]) < 0.5 * street.width_m
        for view in (first, next_look(first, street, rng, config)):
            assert street.place.is_free(view.place)
        ahead = first.target - first.place
        assert abs(ahead[1]) <= np.tan(np.radians(25.01)) * abs(ahead[0])
        depth = render_faces(street.place.faces, camera_at(first, 80, WIDTH, HEIGHT)).depth
        assert np.isfinite(depth).all() and depth.min() > 0.2


def test_a_far_step_goes_along_the_street():
    config = StreetConfig(near_share=0.0, aside=0.0)
    street, rng = street_of(2, config)
    view = draw_look(street, rng, config)
    distance = np.linalg.norm(view.target - view.place)
    steps = np.array([next_look(view, street, rng, config).place - view.place for _ in range(20)])
    np.testing.assert_allclose(steps[:, 1:], 0, atol=1e-9)
    assert np.abs(steps[:, 0]).max() > 0.4 * distance
    assert np.abs(steps[:, 0]).max() <= 0.75 * distance


def test_the_sky_is_above_and_nothing_of_it_is_found_again():
    street, rng = street_of(4)
    low = StreetConfig(height_m=(1.5, 1.6), pitch_deg=1.0, roll_deg=0.0)
    camera = camera_at(draw_look(street, rng, low), 60, WIDTH, HEIGHT)
    seen = render_faces(street.place.faces, camera)
    assert seen.moving.any() and not seen.moving[-1].any()
    points = grid()
    columns, rows = points.astype(int).T
    found = visible_points(seen, camera, world_points(seen, camera, points))
    assert np.isnan(found[seen.moving[rows, columns]]).all()


def test_things_that_pass_are_marked_as_moving():
    config = StreetConfig(moving_max=5)
    street, rng = street_of(5, config)
    faces = [face for _ in range(10) for face in passing_faces(street, rng, config)]
    assert faces and all(face.moving for face in faces)


def test_pieces_of_photographs_are_no_larger_than_a_panel():
    config = StreetConfig(panel_m=3.0)
    street, _ = street_of(6, config)
    ground = [face for face in street.place.faces if not face.moving]
    longest = max(np.linalg.norm(edge) for face in ground for edge in (face.along_u, face.along_v))
    assert 2.0 < longest <= 3.0 + 1e-9


def test_corresponding_points_of_a_street_look_alike():
    config = StreetConfig(texture_px_m=(4.0, 4.0), near_share=1.0)
    rng = np.random.default_rng(3)
    street = make_street(smooth_texture(blur=8), smooth_texture(1, blur=8), rng, config)
    view = draw_look(street, rng, config)
    cameras = [camera_at(v, 80, WIDTH, HEIGHT) for v in (view, next_look(view, street, rng, config))]
    kept, values = corresponding_values(street.place.faces, cameras, grid(step=3))
    assert kept > 0.3
    assert np.median(np.abs(values[0] - values[1])) < 5
    assert np.median(np.abs(values[0] - np.roll(values[1], 7))) > 10


def test_streets_repeat_with_their_seed_and_are_drawn_by_their_share():
    photos = smooth_texture(), smooth_texture(1)
    first, again = (street_scene(*photos, np.random.default_rng(9), SMALL) for _ in range(2))
    for a, b in zip(first.images, again.images, strict=True):
        assert a.shape == (HEIGHT, WIDTH) and np.array_equal(a, b)
    np.testing.assert_array_equal(first.transfer(grid(), 0, 2), again.transfer(grid(), 0, 2))
    scene = make_scene(*photos, [], np.random.default_rng(1), SMALL)  # no height map is needed
    assert len(scene.images) == 3


@pytest.mark.parametrize("tree, message", [
    ({"room_share": 0.5, "street_share": 0.3}, "street_share: found 0.3, expected a share of at"),
    ({"street": {"width_m": [2.0, 5.0]}}, "width_m: found 2.0, expected more than 2.4 m"),
    ({"street": {"far_baseline": [0.2, 1.0]}}, "far_baseline: found 1.0, expected less than 1"),
    ({"street": {"things": [9, 3]}}, "things: found \\[9, 3\\]"),
])
def test_impossible_streets_are_refused(tree, message):
    with pytest.raises(TrainingError, match=message):
        from_mapping(SceneConfig, tree, "scenes")
