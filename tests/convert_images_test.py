#!/usr/bin/env python3
"""Images and calibrations in `python -m deepuav.convert`: encodings of pixels, Bayer patterns, lenses. Skipped where no Python
has rosbags: that of .venv/ has it.

  convert_images_test.py DEEPUAV
"""
import tempfile
import types
from pathlib import Path

from rosbags_python import use_python_with_rosbags

if __name__ == "__main__":
    use_python_with_rosbags()

import numpy as np

from bag_writer import START_NS
from convert_fixtures import CAMERA_IN_BODY, FRAMES, ConvertTest
from deepuav._bag_images import ImageError, raw_pixels  # Of the package that convert_fixtures makes.
from program_under_test import main


class ConvertImages(ConvertTest):
    def test_pixels_of_all_encodings(self):
        def pixels(encoding, data, width, **more):
            data = np.array(data, np.uint8)
            return raw_pixels(types.SimpleNamespace(
                encoding=encoding, height=1, width=width, step=len(data), is_bigendian=more.get("big", 0), data=data)).tolist()

        self.assertEqual(pixels("rgb8", [1, 2, 3, 4, 5, 6], 2), [[[1, 2, 3], [4, 5, 6]]])
        self.assertEqual(pixels("bgr8", [1, 2, 3, 4, 5, 6], 2), [[[3, 2, 1], [6, 5, 4]]])
        self.assertEqual(pixels("bgra8", [1, 2, 3, 9], 1), [[[3, 2, 1]]])
        self.assertEqual(pixels("mono16", [1, 2], 1), [[513]])
        self.assertEqual(pixels("mono16", [1, 2], 1, big=1), [[258]])
        self.assertEqual(pixels("yuv422", [128, 7, 128, 8], 2), [[7, 8]])
        self.assertEqual(pixels("yuv422_yuy2", [7, 128, 8, 128], 2), [[7, 8]])
        self.assertEqual(pixels("mono8", [5, 6, 0, 0], 2), [[5, 6]], "rows may be padded")

    def test_bayer_patterns_become_colours(self):
        def mosaic_of(colours, pattern):
            mosaic = np.empty(colours.shape[:2], colours.dtype)
            for place in range(4):
                rows, columns = slice(place // 2, None, 2), slice(place % 2, None, 2)
                mosaic[rows, columns] = colours[rows, columns, "rgb".index(pattern[place])]
            return mosaic

        def pixels(mosaic, encoding, big=0):
            height, width = mosaic.shape
            return raw_pixels(types.SimpleNamespace(
                encoding=encoding, height=height, width=width, step=width * mosaic.itemsize, is_bigendian=big,
                data=np.frombuffer(mosaic.tobytes(), np.uint8)))

        y, x = np.mgrid[0:6, 0:9]
        ramps = np.stack((10 + 2 * x + 4 * y, 200 - 6 * x, 90 + 8 * y - 2 * x), axis=2)
        even = np.broadcast_to((50, 100, 150), ramps.shape)
        for pattern in ("rggb", "bggr", "gbrg", "grbg"):
            for bits, scale, order in ((8, 1, "<"), (16, 250, "<"), (16, 250, ">")):
                with self.subTest(pattern, bits=bits, order=order):
                    encoding, kind = f"bayer_{pattern}{bits}", f"{order}u{bits // 8}"
                    for colours, inside in ((even, np.s_[:, :]), (ramps, np.s_[1:-1, 1:-1])):
                        mosaic = mosaic_of((colours * scale).astype(kind), pattern)
                        found = pixels(mosaic, encoding, big=int(order == ">"))
                        np.testing.assert_array_equal(found[inside], (colours * scale)[inside])
        own = pixels(np.array([[9, 0], [0, 0]], np.uint8), "bayer_rggb8")
        self.assertEqual(own[0, 0].tolist(), [9, 0, 0])
        with self.assertRaisesRegex(ImageError, "9x1 of a Bayer pattern: expected at least 2x2"):
            pixels(np.zeros((1, 9), np.uint8), "bayer_rggb8")
        bag = self.bag()
        bag.image(START_NS, self.pictures[0], encoding="bayer_grbg8")
        self.assertEqual(self.convert(bag.close(), self.out)[0], 0)
        header = (self.out / f"mav0/cam0/data/{START_NS}.png").read_bytes()[16:26]
        self.assertEqual(header, bytes((0, 0, 1, 64, 0, 0, 0, 240, 8, 2)), "320x240, 8 bits, colours")

    def calibration(self, image_topic, **info):
        """The intrinsics and coefficients of a bag with one image."""
        bag = self.bag()
        bag.image(START_NS, self.pictures[0], topic=image_topic)
        bag.info(START_NS, **info)
        out = Path(tempfile.mkdtemp(dir=self.folder)) / "out"
        status, printed, told = self.convert(bag.close(), out)
        self.assertEqual((status, told, len(printed.splitlines())), (0, "", 1))
        lines = (out / "mav0/cam0/sensor.yaml").read_text().splitlines()
        return [line.partition(": ")[2] for line in lines if line.startswith(("intrinsics", "distortion_c"))]

    def test_rectified_images_have_the_lens_that_they_were_rectified_to(self):
        lens = {"coefficients": (-0.3, 0.1, 0, 0, 0), "projection": (180, 0, 150, -9, 0, 181, 110, 0, 0, 0, 1, 0)}
        of_p, of_k = ["[180.0, 181.0, 150.0, 110.0]", "[0.0, 0.0, 0.0, 0.0]"], "[200.0, 200.0, 159.5, 119.5]"
        for topic in ("/camera/image_rect", "/camera/image_rect_color", "/camera/image_rect/raw"):
            self.assertEqual(self.calibration(topic, **lens), of_p, topic)
        self.assertEqual(self.calibration("/camera/image_rect", model="rational_polynomial", **lens), of_p)
        self.assertEqual(self.calibration("/camera/image_raw", **lens), [of_k, "[-0.3, 0.1, 0.0, 0.0, 0.0]"])
        self.assertEqual(self.calibration("/camera/image_rect_raw")[0], of_k, "neither P nor a distortion")

    def test_a_rational_lens_is_plumb_bob_or_left_to_be_found(self):
        _, coefficients = self.calibration("/camera/image_raw", model="rational_polynomial",
                                           coefficients=(-0.3, 0.1, 0.01, 0.02, 0.03, 0, 0, 0))
        self.assertEqual(coefficients, "[-0.3, 0.1, 0.01, 0.02, 0.03]")
        bag = self.bag()
        bag.transform("imu", "camera", CAMERA_IN_BODY, (0.2, 0, 0))
        for i in range(FRAMES):
            bag.image(START_NS + i * 10**8, self.pictures[i])
        bag.imu(START_NS)
        bag.info(START_NS, model="rational_polynomial", coefficients=(0.4, 0.1, 0, 0, 0.01, 0.5, 0.2, 0.1))
        status, printed, told = self.convert(bag.close(), self.out)
        self.assertEqual((status, told), (0, ""))
        self.assertIn("/camera/camera_info: distortion is rational_polynomial, which is not supported", printed)
        self.assertFalse((self.out / "mav0/cam0/sensor.yaml").exists())
        self.assertIn("model: auto\nwidth: 320\nheight: 240\nfx: 200.0\nfy: 200.0\ncx: 159.5\ncy: 119.5\nrate_hz: 10.0\n",
                      (self.out / "mav0/camera.yaml").read_text())
        place = (self.out / "mav0/imu0/sensor.yaml").read_text().partition("data: [")[2].partition("]")[0]
        np.testing.assert_allclose([float(number) for number in place.split(",")],
                                   [0, -1, 0, 0, 0, 0, -1, 0, 1, 0, 0, -0.2, 0, 0, 0, 1], atol=1e-12)
        done = self.run_converted()
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_bad_images_and_calibrations(self):
        def with_image(**options):
            bag = self.bag()
            bag.image(START_NS, self.pictures[0], **options)
            return bag

        bag = with_image(topic="/camera/image_rect")
        bag.info(START_NS, coefficients=(-0.3, 0.1, 0, 0))
        self.refused((bag.close(), self.out), "of P, fx is 0.0", "above 0")
        self.refused((with_image(encoding="32FC1").close(), self.out), "/camera/image_raw", "'32FC1'", "mono8")
        self.refused((with_image(step=900).close(), self.out), "76800 bytes of 320x240, 900 a row", "expected at least 76800")
        bag = with_image()
        bag.image(START_NS + 1, self.pictures[0][:100])
        self.refused((bag.close(), self.out), "320x100", "expected 320x240")
        bag = self.bag()
        bag.compressed(START_NS, b"GIF89a", form="gif")
        self.refused((bag.close(), self.out), "'gif'", "expected JPEG or PNG")
        for options, found, expected in (({"model": "omni"}, "omni", "plumb_bob"),
                                         ({"model": "rational_polynomial", "coefficients": (1, 2)}, "2 coefficients", "4 or 5"),
                                         ({"coefficients": (1, 2)}, "2 coefficients", "4 or 5"),
                                         ({"focal": 0.0}, "fx is 0.0", "above 0"), ({"width": 640}, "640x240", "320x240")):
            bag = with_image()
            bag.info(START_NS, **options)
            self.refused((bag.close(), self.out), "/camera/camera_info", found, expected)


if __name__ == "__main__":
    main(__doc__)
