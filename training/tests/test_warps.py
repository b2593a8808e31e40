import numpy as np
import pytest

from deepuav_training.data.homography import (HomographyConfig, inside, local_scale,
                                              resize_matrix, sample_homography,
                                              similarity_matrix, translation_matrix, warp_image,
                                              warp_points)
from deepuav_training.data.photometric import (PhotometricConfig, degrade, motion_kernel)


def blob_image(centre, width=96, height=80, sigma=2.0):
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    distance = (x - centre[0]) ** 2 + (y - centre[1]) ** 2
    return np.rint(250 * np.exp(-0.5 * distance / sigma**2)).astype(np.uint8)


def centroid(image):
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    weight = image.astype(float)
    return np.array([(x * weight).sum(), (y * weight).sum()]) / weight.sum()


def test_points_and_their_inverse():
    rng = np.random.default_rng(0)
    homography = sample_homography(rng, HomographyConfig(), 320, 240)
    points = rng.uniform(40, 200, (50, 2))
    back = warp_points(np.linalg.inv(homography), warp_points(homography, points))
    np.testing.assert_allclose(back, points, atol=1e-8)


def test_points_behind_the_camera_are_not_inside():
    homography = np.array([[1, 0, 0], [0, 1, 0], [-0.01, 0, 1.0]])
    warped = warp_points(homography, np.array([[50.0, 0.0], [150.0, 0.0]]))
    assert np.all(np.isfinite(warped[0])) and np.all(np.isnan(warped[1]))
    assert not inside(warped, 1000, 1000)[1]


def test_drawn_rotation_and_scale_keep_their_limits():
    rng = np.random.default_rng(1)
    config = HomographyConfig(rotation_deg=30, any_rotation_share=0, perspective=0, translation=0)
    for _ in range(100):
        h = sample_homography(rng, config, 320, 240)
        assert abs(np.degrees(np.arctan2(h[1, 0], h[0, 0]))) <= 30
        assert 0.5 <= local_scale(h, np.array([159.5, 119.5])) <= 2.0


def test_a_share_of_homographies_has_any_rotation():
    rng = np.random.default_rng(2)
    config = HomographyConfig(any_rotation_share=0.5, perspective=0)
    matrices = [sample_homography(rng, config, 320, 240) for _ in range(400)]
    beyond = np.mean([abs(np.degrees(np.arctan2(h[1, 0], h[0, 0]))) > 45 for h in matrices])
    assert 0.3 < beyond < 0.45  # 0.5 * 135 / 180


@pytest.mark.parametrize("scale", [0.3, 0.6, 1.0, 1.7])
def test_images_and_points_are_warped_alike(scale):
    source = np.array([44.3, 37.6])
    h = (translation_matrix(np.array([48.0, 40.0])) @ similarity_matrix(0.4, scale)
         @ translation_matrix(-np.array([45.0, 39.0])))
    view, mask = warp_image(blob_image(source, sigma=3.0), h, 96, 80)
    np.testing.assert_allclose(centroid(view), warp_points(h, source[None])[0], atol=0.1)
    assert mask[40, 48] == 255


def test_mask_tells_what_lies_outside():
    view, mask = warp_image(np.full((80, 96), 200, np.uint8), translation_matrix((30, 0)), 96, 80)
    assert mask[:, :29].max() == 0 and mask[:, 31:].min() == 255
    assert view[:, :29].max() == 0


def test_resizing_scales_areas():
    np.testing.assert_allclose(warp_points(resize_matrix(0.5, 0.5), np.array([[0.5, 2.5]])),
                               [[0.0, 1.0]])


def test_degrading_repeats_with_the_seed_and_keeps_the_shape():
    image = blob_image((50, 40))
    config = PhotometricConfig(clean_share=0, shadow_share=1, haze_share=1, rain_share=1,
                               blur_share=1, noise_share=1, jpeg_share=1)
    first, again, other = (degrade(image, np.random.default_rng(s), config) for s in (5, 5, 6))
    assert first.shape == image.shape and first.dtype == np.uint8
    assert np.array_equal(first, again) and not np.array_equal(first, other)


def test_clean_share_leaves_images():
    image = blob_image((50, 40))
    assert np.array_equal(degrade(image, np.random.default_rng(0), PhotometricConfig(clean_share=1)),
                          image)


def test_exposure_does_not_burn_the_whole_image():
    image = np.full((64, 64), 130, np.uint8)
    config = PhotometricConfig(clean_share=0, light_share=1, exposure=3, shadow_share=0,
                               haze_share=0, rain_share=0, blur_share=0, noise_share=0,
                               jpeg_share=0)
    for seed in range(20):
        assert 20 < degrade(image, np.random.default_rng(seed), config).mean() < 190


@pytest.mark.parametrize("length,angle", [(1.0, 0.0), (7.3, 0.7), (9.0, 2.5)])
def test_motion_blur_moves_nothing_on_average(length, angle):
    kernel = motion_kernel(length, angle)
    assert abs(kernel.sum() - 1) < 1e-5
    np.testing.assert_allclose(centroid(kernel), [kernel.shape[1] // 2, kernel.shape[0] // 2],
                               atol=1e-4)
