#!/usr/bin/env python3
"""`deepuav simulate` as its users meet it: the dataset that it writes.

  simulate_test.py DEEPUAV
"""
import struct
from pathlib import Path

from program_under_test import FAILURE, main
from simulate_fixtures import DatasetTest, call, files_of, rows_of

ROOT = Path(__file__).resolve().parents[1]
FRAMES = 9  # 0 to 2 s at 4 Hz


def png_format(file):
    """Width, height, bits and colour type of a PNG."""
    return struct.unpack(">IIBB", file.read_bytes()[16:26])


class Simulate(DatasetTest):
    def test_help_and_list(self):
        self.assertIn("Examples", call("simulate", "--help").stdout)
        listed = call("simulate", "--list").stdout
        for file in (ROOT / "flights").glob("*.yaml"):
            self.assertIn(f"  {file.stem} ", listed)
        self.assertIn("village", listed)

    def test_dataset_is_complete(self):
        self.expect_success(self.result)
        mav0 = self.dataset / "mav0"
        frames = rows_of(mav0 / "cam0/data.csv")
        self.assertEqual(len(frames), FRAMES)
        for stamp, name in frames:
            self.assertEqual(name, f"{stamp}.jpg")
            self.assertGreater((mav0 / "cam0/data" / name).stat().st_size, 500)
        truth = rows_of(self.dataset / "groundtruth_cam0.csv")
        self.assertEqual([row[0] for row in truth], [row[0] for row in frames])
        self.assertEqual(len(rows_of(mav0 / "imu0/data.csv")), 401)
        self.assertEqual(len(rows_of(mav0 / "state_groundtruth_estimate0/data.csv")), 401)
        self.assertEqual({len(row) for row in rows_of(mav0 / "state_groundtruth_estimate0/data.csv")}, {17})
        self.assertEqual(len(rows_of(mav0 / "baro0/data.csv")), 41)
        self.assertTrue({len(row) for row in rows_of(mav0 / "gps0/data.csv")} <= {7})
        for sensor in ("cam0", "imu0", "gps0", "baro0"):
            self.assertIn("T_BS", (mav0 / sensor / "sensor.yaml").read_text())

    def test_run_opens_it_and_eval_takes_its_truth(self):
        result = call("run", self.dataset, "--out", self.folder / "run", "--set", "features.model=absent.onnx",
                      "--log-level", "warn")
        self.expect_failure(result, FAILURE, "absent.onnx")
        estimate = self.folder / "estimate.txt"
        lines = []
        for row in rows_of(self.dataset / "groundtruth_cam0.csv"):
            p, q = [2 * float(x) for x in row[1:4]], row[4:8]  # twice as large: Sim3 finds it
            lines.append(f"{row[0][:-9]}.{row[0][-9:]} {p[0]} {p[1]} {p[2]} {q[1]} {q[2]} {q[3]} {q[0]}")
        estimate.write_text("\n".join(lines) + "\n")
        result = call("eval", self.dataset, estimate, "--json", "-")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stdout, r'"rmse": \d(\.\d+)?e-\d\d')

    def test_body_truth_and_camera_truth_agree(self):
        states = {row[0]: [float(x) for x in row[1:4]]
                  for row in rows_of(self.dataset / "mav0/state_groundtruth_estimate0/data.csv")}
        for row in rows_of(self.dataset / "groundtruth_cam0.csv"):
            offset = [float(a) - b for a, b in zip(row[1:4], states[row[0]])]
            self.assertAlmostEqual(sum(x * x for x in offset) ** 0.5, (0.1 ** 2 + 0.03 ** 2) ** 0.5, places=9)

    def test_seed_changes_the_flight(self):
        other = self.folder / "seed"
        self.expect_success(self.simulate(other, "--seed", 2, "--frames", 1))
        for file in ("mav0/imu0/data.csv", "mav0/gps0/data.csv", "mav0/baro0/data.csv", "groundtruth_cam0.csv"):
            self.assertNotEqual((other / file).read_bytes(), (self.dataset / file).read_bytes(), file)

    def test_written_options_are_a_flight(self):
        again = self.folder / "again"
        result = call("simulate", "--flight", self.dataset / "simulation.yaml", "--out", again)
        self.expect_success(result)
        self.assertEqual(files_of(again), files_of(self.dataset))

    def test_hall_has_no_fixes(self):
        out = self.folder / "indoors"
        self.expect_success(self.simulate(out, "--frames", 1, "--set", "gnss.present=false"))
        self.assertFalse((out / "mav0/gps0").exists())
        self.assertTrue((out / "mav0/baro0/data.csv").exists())

    def test_true_orthophoto(self):
        out = self.folder / "from_above"
        self.expect_success(self.simulate(out, "--frames", "2", "--orthophoto", "1"))
        for name in ("orthophoto.tif", "dsm.tif"):
            self.assertEqual((out / name).read_bytes()[:4], b"II*\0")

    def test_depth_and_flow(self):
        out = self.folder / "depth"
        self.expect_success(self.simulate(out, "--frames", 2, "--set", "output.depth=true", "--set",
                                          "output.flow=true", "--set", "output.image_format=png"))
        grey, colour = 0, 2
        for sensor, kind in (("depth0", (96, 64, 16, grey)), ("flow0", (96, 64, 16, colour)),
                             ("cam0", (96, 64, 8, grey))):
            images = sorted((out / "mav0" / sensor / "data").iterdir())
            self.assertEqual(len(images), 2, sensor)
            self.assertEqual({png_format(image) for image in images}, {kind}, sensor)
        self.assertIn("depth_unit_m: 0.01", (out / "mav0/depth0/sensor.yaml").read_text())

    def test_moving_masks_come_beside_unchanged_images(self):
        out, cars = self.folder / "moving", ["--set", "scene.cars_per_km=300", "--set", "output.image_format=png"]
        self.expect_success(self.simulate(out, "--frames", 2, *cars))
        before = files_of(out)
        kept = {image: image.stat().st_mtime_ns for image in (out / "mav0/cam0/data").iterdir()}
        self.expect_success(self.simulate(out, "--frames", 2, "--moving-mask", *cars))
        after = files_of(out)
        masks = {name: after.pop(name) for name in list(after) if name.startswith("mav0/moving0/")}
        self.assertEqual(after, before)
        self.assertEqual({image: image.stat().st_mtime_ns for image in kept}, kept)
        self.assertIn("moving: 255", masks.pop("mav0/moving0/sensor.yaml").decode())
        self.assertEqual({Path(name).name for name in masks}, {image.name for image in kept})
        self.assertEqual({png_format(out / name) for name in masks}, {(96, 64, 8, 0)})
        at_once = self.folder / "moving_at_once"
        self.expect_success(self.simulate(at_once, "--frames", 2, "--moving-mask", *cars))
        self.assertEqual(files_of(at_once), files_of(out))

    def test_shipped_flights_can_be_flown(self):
        for file in sorted((ROOT / "flights").glob("*.yaml")):
            with self.subTest(flight=file.stem):
                out = self.folder / "shipped" / file.stem
                self.expect_success(call("simulate", "--flight", file.stem, "--out", out, "--frames", 1))
                truth = rows_of(out / "groundtruth_cam0.csv")
                least_s = 30
                self.assertGreater(int(truth[-1][0]) - int(truth[0][0]), least_s * 1e9)


if __name__ == "__main__":
    main(__doc__)
