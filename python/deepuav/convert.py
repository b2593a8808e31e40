"""Makes a EuRoC dataset of a ROS bag.

    python -m deepuav.convert flight.bag|flight.db3|flight.mcap|FOLDER OUT

Needs the package rosbags: ``pip install deepuav[convert]``. Memory does not grow with the bag: what is read is written.
"""
from __future__ import annotations

import argparse
import math
import os
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple, TextIO

import numpy as np

from deepuav._bag_images import ImageError, encoded_image
from deepuav._bag_lens import LensError, is_rectified, lens_of, place_yaml
from deepuav._bag_topics import KINDS, TRANSFORMS, Bag, ConvertError, choose, choose_camera_info
from deepuav._bag_transforms import TransformTree, matrix_of


class Report(NamedTuple):
    """What was written."""

    images: int
    imu: int
    fixes: int
    pressures: int
    left_out: dict[str, int]  #: Messages by topic whose times did not grow, or that held no measurement.
    warnings: tuple[str, ...]  #: A line each.


def standard_altitude_m(pressure_pa: float) -> float:
    """In the standard atmosphere."""
    return 288.15 / 0.0065 * (1 - (pressure_pa / 101_325.0) ** (0.0065 * 287.053 / 9.80665))


class _Table:
    """A data.csv that grows line by line, by growing times."""

    def __init__(self, folder: Path, head: str) -> None:
        folder.mkdir(parents=True)
        self.file: TextIO = (folder / "data.csv").open("w", encoding="ascii", newline="\n")
        self.file.write(f"#timestamp [ns],{head}\n")
        self.first = self.last = None
        self.rows = 0

    def takes(self, time_ns: int) -> bool:
        return self.last is None or time_ns > self.last

    def add(self, time_ns: int, *fields: str) -> None:
        self.file.write(",".join((str(time_ns), *fields)) + "\n")
        self.first = time_ns if self.first is None else self.first
        self.last = time_ns
        self.rows += 1

    def rate_hz(self) -> float:
        return 1e9 * (self.rows - 1) / (self.last - self.first) if self.rows > 1 else 0.0


def _numbers(values: Any) -> tuple[str, ...]:
    return tuple(repr(float(value)) for value in values)


class _Writer:
    """Writes what comes, by topic."""

    def __init__(self, bag: Bag, topics: dict[str, str | None], folder: Path) -> None:
        self.bag, self.topics, self.mav0 = bag, topics, folder / "mav0"
        self.tables: dict[str, _Table] = {}
        self.left_out: dict[str, int] = {}
        self.info: Any = None
        self.frames: dict[str, str] = {}
        self.transforms = TransformTree()
        self.size: tuple[int, int] | None = None

    def table(self, name: str, head: str) -> _Table:
        if name not in self.tables:
            self.tables[name] = _Table(self.mav0 / name, head)
        return self.tables[name]

    def leave_out(self, topic: str) -> None:
        self.left_out[topic] = self.left_out.get(topic, 0) + 1

    def take(self, topic: str, recorded_ns: int, message: Any) -> None:
        if topic not in self.topics.values():
            self.transforms.add(message)
            return
        kind = next(kind for kind, chosen in self.topics.items() if chosen == topic)
        stamp = message.header.stamp
        time_ns = int(stamp.sec) * 10**9 + int(stamp.nanosec)
        self.frames.setdefault(kind, message.header.frame_id)
        getattr(self, "_" + kind)(topic, time_ns if time_ns > 0 else recorded_ns, message)

    def _image(self, topic: str, time_ns: int, message: Any) -> None:
        table = self.table("cam0", "filename")
        if not table.takes(time_ns):
            return self.leave_out(topic)
        try:
            data, ending, size = encoded_image(message)
        except ImageError as error:
            raise ConvertError(f"{self.bag.path}: topic {topic}: image of {time_ns} ns: {error}") from error
        if size and size != (self.size or size):
            raise ConvertError(f"{self.bag.path}: topic {topic}: image of {time_ns} ns is {size[0]}x{size[1]}: expected "
                               f"{self.size[0]}x{self.size[1]} as the first")
        self.size = self.size or size
        images = self.mav0 / "cam0/data"
        images.mkdir(exist_ok=True)
        name = f"{time_ns}{ending}"
        (images / name).write_bytes(data)
        table.add(time_ns, name)

    def _camera_info(self, _topic: str, _time_ns: int, message: Any) -> None:
        self.info = self.info or message

    def _imu(self, topic: str, time_ns: int, message: Any) -> None:
        table = self.table("imu0", "w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
                                   "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]")
        turn, force = message.angular_velocity, message.linear_acceleration
        values = (turn.x, turn.y, turn.z, force.x, force.y, force.z)
        # REP 145: what is not measured has -1 in its covariance.
        measured = message.angular_velocity_covariance[0] != -1 and message.linear_acceleration_covariance[0] != -1
        if not table.takes(time_ns) or not measured or not all(map(math.isfinite, values)):
            return self.leave_out(topic)
        table.add(time_ns, *_numbers(values))

    def _fix(self, topic: str, time_ns: int, message: Any) -> None:
        table = self.table("gps0", "latitude [deg],longitude [deg],altitude [m],std_east [m],std_north [m],std_up [m]")
        values = (message.latitude, message.longitude, message.altitude)
        if message.status.status < 0 or not table.takes(time_ns) or not all(map(math.isfinite, values)):
            return self.leave_out(topic)
        known = message.position_covariance_type != 0
        variances = [float(message.position_covariance[i]) if known else 0.0 for i in (0, 4, 8)]
        sigmas = [math.sqrt(value) if math.isfinite(value) and value > 0 else 0.0 for value in variances]
        table.add(time_ns, *_numbers((*values, *sigmas)))

    def _pressure(self, topic: str, time_ns: int, message: Any) -> None:
        table = self.table("baro0", "pressure [Pa],altitude [m]")
        pressure_pa = float(message.fluid_pressure)
        if not table.takes(time_ns) or not 1_000 < pressure_pa < 200_000:
            return self.leave_out(topic)
        table.add(time_ns, *_numbers((pressure_pa, standard_altitude_m(pressure_pa))))

    def body_from_cam(self, given: np.ndarray | None) -> np.ndarray:
        """The body is the inertial sensor, where there is one."""
        if given is not None or "imu0" not in self.tables:
            return np.eye(4) if given is None else given
        camera, imu = self.frames["image"], self.frames["imu"]
        found = self.transforms.between(imu, camera)
        if found is None:
            raise ConvertError(f"{self.bag.path}: topic {self.topics['imu']}: no transform from '{camera}', the camera's frame, to "
                               f"'{imu}' in /tf_static: expected --imu-from-camera with 16 numbers, or --imu none")
        return found

    def finish(self, imu_from_cam: np.ndarray | None) -> Report:
        for table in self.tables.values():
            table.file.close()
        rows = {name: table.rows for name, table in self.tables.items()}
        if not rows.get("cam0"):
            raise ConvertError(f"{self.bag.path}: topic {self.topics['image']}: no images: expected some")
        for name in [name for name, count in rows.items() if count == 0]:
            shutil.rmtree(self.mav0 / name)
            del self.tables[name]
        warnings = self.write_lens(imu_from_cam)
        return Report(rows["cam0"], rows.get("imu0", 0), rows.get("gps0", 0), rows.get("baro0", 0), self.left_out, warnings)

    def write_lens(self, imu_from_cam: np.ndarray | None) -> tuple[str, ...]:
        """Returns what is to be known of it."""
        body_from_cam = self.body_from_cam(imu_from_cam)
        if self.info is None:
            self.place_about_camera(body_from_cam)
            return ("no calibration in the bag: `deepuav run` needs --camera camera.yaml",)
        where = f"{self.bag.path}: topic {self.topics['camera_info']}"
        if self.size and self.size != (self.info.width, self.info.height):
            raise ConvertError(f"{where}: {self.info.width}x{self.info.height}: expected {self.size[0]}x{self.size[1]} as the "
                               "images")
        try:
            lens = lens_of(self.info, is_rectified(self.topics["image"] or ""))
        except LensError as error:
            raise ConvertError(f"{where}: {error}") from error
        rate_hz = self.tables["cam0"].rate_hz()
        if lens.is_known:
            (self.mav0 / "cam0/sensor.yaml").write_text(lens.sensor_yaml(rate_hz, body_from_cam))
            return ()
        self.place_about_camera(body_from_cam)
        (self.mav0 / "camera.yaml").write_text(lens.camera_yaml(rate_hz))
        return (f"{self.topics['camera_info']}: distortion is {lens.model}, which is not supported: `deepuav run` looks for the "
                "lens in the images, from mav0/camera.yaml on",)

    def place_about_camera(self, body_from_cam: np.ndarray) -> None:
        """Says where the other sensors are, where no sensor.yaml of the camera does: then it is the body."""
        for name in self.tables:
            if name != "cam0":
                (self.mav0 / name / "sensor.yaml").write_text(place_yaml(np.linalg.inv(body_from_cam)))

    def close(self) -> None:
        for table in self.tables.values():
            table.file.close()


def convert(bag: str | os.PathLike[str], out: str | os.PathLike[str], *, image: str | None = None,
            camera_info: str | None = None, imu: str | None = None, fix: str | None = None, pressure: str | None = None,
            imu_from_camera: Any = None) -> Report:
    """Writes the bag's images, inertial samples, position fixes, pressures and calibration as a EuRoC dataset.

    The topics are those of their types; where there are several, ``image`` and the others name one, or "none" (but for
    images). ``imu_from_camera``: 4x4, where /tf_static does not say it. ``out`` must not be there, or be empty; it is there
    once it is whole. Raises :class:`ConvertError`.
    """
    out = Path(out)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ConvertError(f"{out}: is there: expected a folder that is new or empty")
    transform = None if imu_from_camera is None else matrix_of(imu_from_camera)
    if imu_from_camera is not None and transform is None:
        raise ConvertError("imu_from_camera: expected a rigid transform of 4x4 numbers by rows")
    source = Bag(Path(bag))
    try:
        topics = {"image": choose(source, "image", image, required=True)}
        topics["camera_info"] = choose_camera_info(source, camera_info, topics["image"] or "")
        for kind, wanted in (("imu", imu), ("fix", fix), ("pressure", pressure)):
            topics[kind] = choose(source, kind, wanted, required=False)
        out.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{out.name}-", dir=out.parent) as scratch:
            writer = _Writer(source, topics, Path(scratch) / "dataset")
            try:
                static = {topic for topic in source.topics((TRANSFORMS,)) if topic.endswith("tf_static")}
                for topic, recorded_ns, message in source.messages({t for t in topics.values() if t} | static):
                    writer.take(topic, recorded_ns, message)
                report = writer.finish(transform)
            finally:
                writer.close()
            if out.exists():
                out.rmdir()
            (Path(scratch) / "dataset").rename(out)
        return report
    finally:
        source.close()


def _arguments(words: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m deepuav.convert", description="Makes a EuRoC dataset of a ROS bag.")
    parser.add_argument("bag", metavar="BAG", help="flight.bag, flight.db3, flight.mcap, or the folder of a ROS 2 bag")
    parser.add_argument("out", metavar="OUT", help="folder for the dataset, new or empty")
    for kind, types in KINDS.items():
        names = " or ".join(name.rsplit("/", 1)[1] for name in types)
        parser.add_argument(f"--{kind.replace('_', '-')}", metavar="TOPIC",
                            help=f"the topic of type {names}, where there are several" + ("" if kind == "image" else "; none: left out"))
    parser.add_argument("--imu-from-camera", metavar="NUMBER", nargs=16, type=float,
                        help="4x4 by rows, where /tf_static does not say it")
    return parser.parse_args(words)


def main(words: list[str] | None = None) -> int:
    """The command."""
    arguments = vars(_arguments(words))
    try:
        report = convert(**arguments)
    except (ConvertError, OSError) as error:
        print(f"deepuav.convert: {error}", file=sys.stderr)
        return 1
    print(f"{report.images} images, {report.imu} inertial samples, {report.fixes} fixes, {report.pressures} pressures")
    for topic, count in sorted(report.left_out.items()):
        print(f"{topic}: {count} messages left out, whose times do not grow or that measure nothing")
    for warning in report.warnings:
        print(warning)
    return 0


if __name__ == "__main__":
    sys.exit(main())
