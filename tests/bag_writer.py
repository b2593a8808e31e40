"""Writes ROS bags of one camera and its companions, for tests; needs rosbags."""
import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import layered_scene

START_NS = 1_700_000_000 * 10**9
IMAGE, COMPRESSED, INFO, IMU, FIX, PRESSURE, TRANSFORMS = (
    "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/NavSatFix", "sensor_msgs/msg/FluidPressure", "tf2_msgs/msg/TFMessage")


class Bag:
    """A bag that is written: `add(topic, type, time_ns, fields...)`."""

    def __init__(self, folder, kind):
        self.is1 = kind == ".bag"
        self.store = get_typestore(Stores.ROS1_NOETIC if self.is1 else Stores.ROS2_HUMBLE)
        if self.is1:
            self.file = folder / "flight.bag"
            self.writer = Writer1(self.file)
            definitions = ("tf2_msgs/msg/TFMessage",)
            if definitions[0] not in self.store.fielddefs:
                self.store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TRANSFORMS))
        else:
            plugin = StoragePlugin.MCAP if kind == ".mcap" else StoragePlugin.SQLITE3
            self.writer = Writer2(folder / "flight", version=9, storage_plugin=plugin)
            self.file = folder / f"flight/flight{kind}"
        self.writer.open()
        self.connections = {}

    def make(self, name, **fields):
        return self.store.types[name](**fields)

    def header(self, time_ns, frame):
        stamp = self.make("builtin_interfaces/msg/Time", sec=time_ns // 10**9, nanosec=time_ns % 10**9)
        more = {"seq": 0} if self.is1 else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **more)

    def vector(self, x, y, z):
        return self.make("geometry_msgs/msg/Vector3", x=float(x), y=float(y), z=float(z))

    def quaternion(self, x, y, z, w):
        return self.make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def add(self, topic, kind, time_ns, message):
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, kind, typestore=self.store)
        serialise = self.store.serialize_ros1 if self.is1 else self.store.serialize_cdr
        self.writer.write(self.connections[topic], time_ns, serialise(message, kind))

    def image(self, time_ns, rows, encoding="mono8", topic="/camera/image_raw", step=0, recorded_ns=None):
        data = np.frombuffer(b"".join(bytes(row) for row in rows), np.uint8)
        width = layered_scene.WIDTH
        step = step or len(data) // len(rows)
        self.add(topic, IMAGE, recorded_ns or time_ns, self.make(
            IMAGE, header=self.header(time_ns, "camera"), height=len(rows), width=width, encoding=encoding, is_bigendian=0,
            step=step, data=data))

    def compressed(self, time_ns, data, form="jpeg", topic="/camera/image_raw/compressed"):
        self.add(topic, COMPRESSED, time_ns, self.make(COMPRESSED, header=self.header(time_ns, "camera"), format=form,
                                                       data=np.frombuffer(data, np.uint8)))

    def info(self, time_ns, topic="/camera/camera_info", model="plumb_bob", coefficients=(0, 0, 0, 0, 0), focal=None,
             width=layered_scene.WIDTH, projection=(0,) * 12):
        focal = layered_scene.FOCAL_PX if focal is None else focal
        k = [focal, 0, (layered_scene.WIDTH - 1) / 2, 0, focal, (layered_scene.HEIGHT - 1) / 2, 0, 0, 1]
        names = "DKRP" if self.is1 else "dkrp"
        values = (coefficients, k, np.eye(3).ravel(), projection)
        roi = self.make("sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
        self.add(topic, INFO, time_ns, self.make(
            INFO, header=self.header(time_ns, "camera"), height=layered_scene.HEIGHT, width=width, distortion_model=model,
            binning_x=0, binning_y=0, roi=roi, **{name: np.array(value, float) for name, value in zip(names, values)}))

    def imu(self, time_ns, turn=(0.1, 0.2, 0.3), force=(0, 0, 9.8), covariance=0.0, topic="/imu"):
        none = np.zeros(9)
        self.add(topic, IMU, time_ns, self.make(
            IMU, header=self.header(time_ns, "imu"), orientation=self.quaternion(0.0, 0.0, 0.0, 1.0), orientation_covariance=none,
            angular_velocity=self.vector(*turn), angular_velocity_covariance=np.full(9, covariance),
            linear_acceleration=self.vector(*force), linear_acceleration_covariance=none))

    def fix(self, time_ns, latitude=47.5, altitude=430.25, status=0, topic="/gps/fix"):
        state = self.make("sensor_msgs/msg/NavSatStatus", status=status, service=1)
        self.add(topic, FIX, time_ns, self.make(
            FIX, header=self.header(time_ns, "gps"), status=state, latitude=latitude, longitude=8.25, altitude=altitude,
            position_covariance=np.diag((4.0, 9.0, 16.0)).ravel(), position_covariance_type=2))

    def pressure(self, time_ns, pascal=95_000.0, topic="/pressure"):
        self.add(topic, PRESSURE, time_ns, self.make(PRESSURE, header=self.header(time_ns, "baro"), fluid_pressure=pascal,
                                                     variance=0.0))

    def transform(self, parent, child, rotation, translation):
        one = self.make("geometry_msgs/msg/TransformStamped", header=self.header(START_NS, parent), child_frame_id=child,
                        transform=self.make("geometry_msgs/msg/Transform", translation=self.vector(*translation),
                                            rotation=self.quaternion(*rotation)))
        self.add("/tf_static", TRANSFORMS, START_NS, self.make(TRANSFORMS, transforms=[one]))

    def close(self):
        self.writer.close()
        return self.file
