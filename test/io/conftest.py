# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Images, messages and tiny bags for the tests of phase_traj_ros.io."""

import array
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

SECOND = 1_000_000_000


def smooth_picture(height: int, width: int, seed: int) -> np.ndarray:
    """Return a colour picture, (H, W, 3) uint8 in the order blue, green, red."""
    noise = np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)
    blurred = cv2.GaussianBlur(noise, (0, 0), 3)
    return cv2.normalize(blurred, None, 0, 255, cv2.NORM_MINMAX)


@pytest.fixture
def picture() -> Callable[..., np.ndarray]:
    """Return a function that makes smooth random colour images, (H, W, 3) uint8, BGR."""
    def make(height: int = 24, width: int = 32, seed: int = 0) -> np.ndarray:
        return smooth_picture(height, width, seed)
    return make


@pytest.fixture
def image_msg() -> Callable[..., SimpleNamespace]:
    """Return a maker of objects with the fields of sensor_msgs/Image."""
    def make(
        array: np.ndarray,
        encoding: str,
        *,
        padding: int = 0,
        big_endian: bool = False,
        data: Callable[[bytes], object] = bytes,
    ) -> SimpleNamespace:
        height, width = array.shape[:2]
        if array.itemsize > 1:
            array = array.astype(array.dtype.newbyteorder('>' if big_endian else '<'))
        rows = np.frombuffer(array.tobytes(), np.uint8).reshape(height, -1)
        padded = np.pad(rows, ((0, 0), (0, padding)), constant_values=0xA5)
        return SimpleNamespace(
            height=height, width=width, encoding=encoding, is_bigendian=int(big_endian),
            step=padded.shape[1], data=data(padded.tobytes()))
    return make


class RosTypes:
    """The messages of a ROS installation, with the interface of a typestore of rosbags."""

    def __init__(self) -> None:
        self.types = self

    def __getitem__(self, name: str) -> Callable[..., Any]:
        package, _, kind = name.split('/')
        made = getattr(import_module(f'{package}.msg'), kind)
        return lambda **fields: made(**{key: self._plain(each) for key, each in fields.items()})

    @staticmethod
    def serialize_cdr(message: Any, _: str) -> bytes:
        return import_module('rclpy.serialization').serialize_message(message)

    @staticmethod
    def _plain(value: Any) -> Any:
        if not isinstance(value, np.ndarray):
            return value
        return array.array('B', value.tobytes()) if value.dtype == np.uint8 else value.tolist()


class RosWriter:
    """Writes a bag with rosbag2_py, with the interface of the writer of rosbags."""

    def __init__(self, path: Path, storage: str) -> None:
        self._rosbag2 = import_module('rosbag2_py')
        self._options = self._rosbag2.StorageOptions(uri=str(path), storage_id=storage)
        self._writer = self._rosbag2.SequentialWriter()

    def __enter__(self) -> 'RosWriter':
        self._writer.open(self._options, self._rosbag2.ConverterOptions('', ''))
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()

    def add_connection(self, topic: str, kind: str, **_: object) -> str:
        self._writer.create_topic(self._rosbag2.TopicMetadata(
            id=0, name=topic, type=kind, serialization_format='cdr'))
        return topic

    def write(self, topic: str, when: int, data: bytes) -> None:
        self._writer.write(topic, data, when)


class BagMaker:
    """
    Make messages of one version of ROS, and write them into bags.

    kind is mcap, sqlite3 or ros1.
    """

    def __init__(self, kind: str) -> None:
        self.kind = kind
        if kind != 'ros1' and not find_spec('rosbags') and find_spec('rosbag2_py'):
            self.typestore = RosTypes()
            return
        typesys = pytest.importorskip('rosbags.typesys')
        store = typesys.Stores.ROS1_NOETIC if kind == 'ros1' else typesys.Stores.ROS2_JAZZY
        self.typestore = typesys.get_typestore(store)
        if kind == 'ros1':
            self.typestore.register(typesys.get_types_from_msg(
                'geometry_msgs/TransformStamped[] transforms', 'tf2_msgs/msg/TFMessage'))

    def header(self, stamp_ns: int, frame_id: str = 'camera') -> Any:
        """Return a std_msgs/Header."""
        time = self.typestore.types['builtin_interfaces/msg/Time'](
            sec=stamp_ns // SECOND, nanosec=stamp_ns % SECOND)
        fields = {'seq': 0} if self.kind == 'ros1' else {}
        return self.typestore.types['std_msgs/msg/Header'](
            stamp=time, frame_id=frame_id, **fields)

    def image(self, array: np.ndarray, stamp_ns: int, encoding: str = 'mono8') -> Any:
        """Return a raw image message."""
        return self.typestore.types['sensor_msgs/msg/Image'](
            header=self.header(stamp_ns), height=array.shape[0], width=array.shape[1],
            encoding=encoding, is_bigendian=0, step=array.strides[0],
            data=np.frombuffer(array.tobytes(), np.uint8))

    def compressed(self, array: np.ndarray, stamp_ns: int, suffix: str = '.png') -> Any:
        """Return a compressed image message."""
        done, data = cv2.imencode(suffix, array)
        assert done
        return self.typestore.types['sensor_msgs/msg/CompressedImage'](
            header=self.header(stamp_ns), format=suffix[1:], data=data.ravel())

    def camera_info(
        self, *, focal: float = 30.0, width: int = 32, height: int = 24,
        distortion: tuple[float, ...] = (-0.1, 0.0, 0.0, 0.0, 0.0),
    ) -> Any:
        """Return the calibration of a camera; rectified, its focal length is 1 more."""
        matrix = np.array((focal, 0, width / 2, 0, focal, height / 2, 0, 0, 1), np.float64)
        projection = np.hstack((matrix.reshape(3, 3), np.zeros((3, 1)))).ravel()
        projection[[0, 5]] += np.sign(focal)
        fields = {
            'd': np.array(distortion), 'k': matrix, 'r': np.eye(3).ravel(), 'p': projection}
        if self.kind == 'ros1':
            fields = {name.upper(): value for name, value in fields.items()}
        roi = self.typestore.types['sensor_msgs/msg/RegionOfInterest'](
            x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
        return self.typestore.types['sensor_msgs/msg/CameraInfo'](
            header=self.header(SECOND), height=height, width=width,
            distortion_model='plumb_bob', binning_x=0, binning_y=0, roi=roi, **fields)

    def transforms(self, *links: tuple[str, str, tuple[float, ...], tuple[float, ...]]) -> Any:
        """Return a TFMessage: from each frame to each other, the place and the quaternion."""
        types = self.typestore.types
        return types['tf2_msgs/msg/TFMessage'](transforms=[
            types['geometry_msgs/msg/TransformStamped'](
                header=self.header(SECOND, above), child_frame_id=below,
                transform=types['geometry_msgs/msg/Transform'](
                    translation=types['geometry_msgs/msg/Vector3'](**dict(zip('xyz', place))),
                    rotation=types['geometry_msgs/msg/Quaternion'](
                        **dict(zip('xyzw', rotation)))))
            for above, below, place, rotation in links])

    def text(self, text: str) -> Any:
        """Return a std_msgs/String."""
        return self.typestore.types['std_msgs/msg/String'](data=text)

    def write(self, path: Path, topics: dict[str, tuple[str, list[tuple[int, Any]]]]) -> Path:
        """
        Write a bag of {topic: (type, [(receive_ns, message)])}.

        Returns its path: the directory of a ROS 2 bag, the file of a ROS 1 bag.
        """
        if self.kind == 'ros1':
            from rosbags.rosbag1 import Writer
            path = path.with_suffix('.bag')
            writer = Writer(path)
            serialise = self.typestore.serialize_ros1
        elif isinstance(self.typestore, RosTypes):
            writer, serialise = RosWriter(path, self.kind), self.typestore.serialize_cdr
        else:
            from rosbags.rosbag2 import StoragePlugin, Writer
            writer = Writer(
                path, version=8, storage_plugin=StoragePlugin[self.kind.upper()])
            serialise = self.typestore.serialize_cdr
        with writer:
            entries = []
            for topic, (msgtype, messages) in topics.items():
                connection = writer.add_connection(topic, msgtype, typestore=self.typestore)
                entries += [(when, connection, msgtype, msg) for when, msg in messages]
            for when, connection, msgtype, msg in sorted(entries, key=lambda each: each[0]):
                writer.write(connection, when, serialise(msg, msgtype))
        return path

    def drive(
        self,
        path: Path,
        *,
        frames: int = 5,
        start_ns: int = 100 * SECOND,
        period_ns: int = SECOND // 10,
        latency_ns: int = 3_000_000,
    ) -> Path:
        """Write a bag of grey 24x32 frames on /camera/image_raw and a few other messages."""
        times = [start_ns + index * period_ns for index in range(frames)]
        return self.write(path, {
            '/camera/image_raw': ('sensor_msgs/msg/Image', [
                (when + latency_ns, self.image(grey_frame(index), when))
                for index, when in enumerate(times)]),
            '/chatter': ('std_msgs/msg/String', [
                (when, self.text('hello')) for when in times]),
        })

    def single_file(self, path: Path) -> Path:
        """Return the storage file of a bag that was written."""
        if self.kind == 'ros1':
            return path
        return next(path.glob('*.mcap' if self.kind == 'mcap' else '*.db3'))


def grey_frame(index: int) -> np.ndarray:
    """Return the grey frame that BagMaker.drive writes at that index."""
    return cv2.cvtColor(smooth_picture(24, 32, index), cv2.COLOR_BGR2GRAY)


@pytest.fixture(params=['mcap', 'sqlite3', 'ros1'])
def maker(request: pytest.FixtureRequest) -> BagMaker:
    """Return a maker of bags, of each kind in turn."""
    return BagMaker(request.param)


@pytest.fixture
def mcap_maker() -> BagMaker:
    """Return a maker of ROS 2 bags of MCAP files."""
    return BagMaker('mcap')


@pytest.fixture
def drive_frame() -> Callable[[int], np.ndarray]:
    """Return the function from an index to the frame that BagMaker.drive writes there."""
    return grey_frame
