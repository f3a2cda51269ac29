# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes a drive as a rosbag2, with its ground truth."""

from __future__ import annotations

from collections.abc import Callable
import os
from pathlib import Path
from typing import Any, TYPE_CHECKING

import numpy as np
from phase_traj_ros.errors import rosbags_missing
from phase_traj_ros.synthetic.arrays import Bytes
from phase_traj_ros.synthetic.camera import Camera, Pose, quaternion
from phase_traj_ros.synthetic.drive.drive import Drive
from phase_traj_ros.synthetic.drive.frames import render_drive
from phase_traj_ros.topics import camera_info_topic

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

#: The topics and coordinate frames of the ground truth and of the vehicle's speed.
TRUTH_TOPIC = '/ground_truth/pose'
SPEED_TOPIC = '/speed'
_MAP = 'map'
_CAMERA = 'camera'
_VEHICLE = 'base_link'


class _Messages:
    """Makes and serialises the messages."""

    def __init__(self, store: Typestore, camera: Camera) -> None:
        self._store = store
        self._types = store.types
        self._camera = camera

    def _header(self, stamp_ns: int, frame_id: str) -> Any:
        stamp = self._types['builtin_interfaces/msg/Time'](
            sec=stamp_ns // 10 ** 9, nanosec=stamp_ns % 10 ** 9)
        return self._types['std_msgs/msg/Header'](stamp=stamp, frame_id=frame_id)

    def _serialised(self, message: Any) -> memoryview:
        return self._store.serialize_cdr(message, message.__msgtype__)

    def image(self, stamp_ns: int, frame: Bytes) -> memoryview:
        (height, width) = frame.shape
        return self._serialised(self._types['sensor_msgs/msg/Image'](
            header=self._header(stamp_ns, _CAMERA), height=height, width=width,
            encoding='mono8', is_bigendian=0, step=width, data=frame.reshape(-1)))

    def camera_info(self, stamp_ns: int) -> memoryview:
        matrix, fisheye = self._camera.matrix(), self._camera.fisheye
        return self._serialised(self._types['sensor_msgs/msg/CameraInfo'](
            header=self._header(stamp_ns, _CAMERA), height=self._camera.height,
            width=self._camera.width,
            distortion_model='plumb_bob' if fisheye is None else 'equidistant',
            d=np.zeros(5) if fisheye is None else np.array(fisheye),
            k=matrix.ravel(), r=np.eye(3).ravel(),
            p=np.concatenate([matrix, np.zeros((3, 1))], axis=1).ravel(),
            binning_x=0, binning_y=0,
            roi=self._types['sensor_msgs/msg/RegionOfInterest'](
                x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)))

    def pose(self, stamp_ns: int, pose: Pose) -> memoryview:
        (x, y, z, w) = quaternion(pose)
        return self._serialised(self._types['geometry_msgs/msg/PoseStamped'](
            header=self._header(stamp_ns, _MAP),
            pose=self._types['geometry_msgs/msg/Pose'](
                position=self._types['geometry_msgs/msg/Point'](
                    x=pose.x, y=pose.y, z=self._camera.above_ground),
                orientation=self._types['geometry_msgs/msg/Quaternion'](x=x, y=y, z=z, w=w))))

    def speed(self, stamp_ns: int, speed: float) -> memoryview:
        vector = self._types['geometry_msgs/msg/Vector3']
        return self._serialised(self._types['geometry_msgs/msg/TwistStamped'](
            header=self._header(stamp_ns, _VEHICLE),
            twist=self._types['geometry_msgs/msg/Twist'](
                linear=vector(x=speed, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=0.0))))


def write_drive_bag(
    drive: Drive, path: str | os.PathLike[str], *, image_topic: str = '/camera/image',
    progress: Callable[[], object] | None = None,
) -> None:
    """
    Write a drive as a rosbag2 (a directory with an MCAP file).

    For each frame, with its stamp: ``sensor_msgs/Image`` (mono8) on ``image_topic``,
    ``sensor_msgs/CameraInfo`` on ``camera_info`` beside it, the true pose of the camera as
    ``geometry_msgs/PoseStamped`` on ``/ground_truth/pose`` (ROS axes, frame ``map``), and the
    speed from this frame to the next as ``geometry_msgs/TwistStamped`` on ``/speed``.

    ``progress`` is called after each frame. ``path`` must not exist. Raises
    `MissingDependencyError` if the rosbags library is not installed.
    """
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import get_typestore, Stores
    except ImportError as error:
        raise rosbags_missing('writing a bag', error) from error
    store = get_typestore(Stores.ROS2_JAZZY)
    messages = _Messages(store, drive.camera)
    with Writer(Path(path), version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        (images, infos, truth, speeds) = (
            writer.add_connection(topic, message_type, typestore=store)
            for (topic, message_type) in (
                (image_topic, 'sensor_msgs/msg/Image'),
                (camera_info_topic(image_topic), 'sensor_msgs/msg/CameraInfo'),
                (TRUTH_TOPIC, 'geometry_msgs/msg/PoseStamped'),
                (SPEED_TOPIC, 'geometry_msgs/msg/TwistStamped')))
        speed = _speeds(drive)
        for (index, frame) in enumerate(render_drive(drive)):
            stamp_ns = int(drive.stamps_ns[index])
            writer.write(infos, stamp_ns, messages.camera_info(stamp_ns))
            writer.write(images, stamp_ns, messages.image(stamp_ns, frame))
            writer.write(truth, stamp_ns, messages.pose(stamp_ns, drive.pose(index)))
            writer.write(speeds, stamp_ns, messages.speed(stamp_ns, speed[index]))
            if progress is not None:
                progress()


def _speeds(drive: Drive) -> list[float]:
    """Return the speed from each frame to the next in m/s; the last speed is repeated."""
    steps = np.diff(drive.poses[:, :2], axis=0)
    speeds = np.hypot(steps[:, 0], steps[:, 1]) / np.diff(drive.stamps_ns) * 1e9
    return [*speeds.tolist(), *speeds[-1:].tolist()] or [0.0]
