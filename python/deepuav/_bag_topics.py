"""A ROS bag and which of its topics are taken."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Iterator

#: What is taken of a bag: option, types, whether several topics of them need a choice.
IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
CAMERA, IMU, FIX, PRESSURE = (f"sensor_msgs/msg/{name}" for name in ("CameraInfo", "Imu", "NavSatFix", "FluidPressure"))
TRANSFORMS = "tf2_msgs/msg/TFMessage"
KINDS = {"image": IMAGES, "camera_info": (CAMERA,), "imu": (IMU,), "fix": (FIX,), "pressure": (PRESSURE,)}
OMITTED = "none"


class ConvertError(Exception):
    """What is wrong with a bag, or with what was asked of it, in one line."""


class Bag:
    """An open bag: its topics by kind, its messages in order."""

    def __init__(self, path: Path) -> None:
        try:
            from rosbags.highlevel import AnyReader
            from rosbags.typesys import Stores, get_typestore
        except ImportError as error:
            raise ConvertError(f"{path}: no package rosbags to read it: expected `pip install deepuav[convert]`") from error
        if not path.exists():
            raise ConvertError(f"{path}: is not there: expected a bag (.bag, .db3, .mcap, or the folder of one)")
        if path.is_file() and path.suffix not in (".bag", ".db3", ".mcap"):
            raise ConvertError(f"{path}: ends in '{path.suffix}': expected .bag, .db3 or .mcap, or the folder of a bag")
        self.path = path
        # Databases before Iron hold no definitions; these messages have not changed since.
        self.reader = self._guard(lambda: AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)))
        self._guard(self.reader.open)

    def _guard(self, step: Any) -> Any:
        """What goes wrong in reading, in one line."""
        try:
            return step()
        except ConvertError:
            raise
        except Exception as error:  # A damaged bag can fail in any way.
            why = " ".join(str(error).split()) or type(error).__name__
            raise ConvertError(f"{self.path}: cannot be read as a bag: {why}") from error

    def close(self) -> None:
        if self.reader.stack:
            self.reader.close()

    def topics(self, types: tuple[str, ...]) -> dict[str, str]:
        """Types by topic."""
        return {c.topic: c.msgtype for c in self.reader.connections if c.msgtype in types}

    def messages(self, topics: set[str]) -> Iterator[tuple[str, int, Any]]:
        """Topic, time of recording, message."""
        connections = [c for c in self.reader.connections if c.topic in topics]
        if not connections:
            return
        iterator = iter(self.reader.messages(connections))
        while True:
            item = self._guard(lambda: next(iterator, None))
            if item is None:
                return
            connection, recorded_ns, raw = item
            try:
                message = self.reader.deserialize(raw, connection.msgtype)
            except Exception as error:
                raise ConvertError(f"{self.path}: topic {connection.topic}: a message at {recorded_ns} ns that is no "
                                   f"{connection.msgtype}: {' '.join(str(error).split())}") from error
            yield connection.topic, recorded_ns, message


def choose(bag: Bag, kind: str, wanted: str | None, required: bool) -> str | None:
    """The topic of a kind: as asked for, or the only one."""
    types, option = KINDS[kind], f"--{kind.replace('_', '-')}"
    found = bag.topics(types)
    names = " or ".join(name.rsplit("/", 1)[1] for name in types)
    there = ", ".join(sorted(found)) or "none"
    if wanted == OMITTED and not required:
        return None
    if wanted is not None:
        if wanted not in found:
            raise ConvertError(f"{bag.path}: topic {wanted}: not there as {names}: expected one of: {there}")
        return wanted
    if len(found) > 1:
        raise ConvertError(f"{bag.path}: topics {there} are all {names}: expected one, by {option} TOPIC")
    if not found and required:
        all_topics = ", ".join(f"{c.topic} ({c.msgtype})" for c in bag.reader.connections) or "none"
        raise ConvertError(f"{bag.path}: topics are {all_topics}: expected one of type {names}")
    return next(iter(found), None)


def choose_camera_info(bag: Bag, wanted: str | None, image_topic: str) -> str | None:
    """The one beside the images, where there are several."""
    found = bag.topics((CAMERA,))
    if wanted is None and len(found) > 1:
        near = [topic for topic in found if image_topic.startswith(topic.rsplit("/", 1)[0] + "/")]
        if len(near) == 1:
            return near[0]
    return choose(bag, "camera_info", wanted, required=False)
