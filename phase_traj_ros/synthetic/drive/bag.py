# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes a drive as a rosbag2, with its ground truth."""

from collections.abc import Callable, Mapping
import os
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from phase_traj_ros.errors import rosbags_missing
from phase_traj_ros.synthetic.camera import Camera, Pose, quaternion
from phase_traj_ros.synthetic.drive.drive import Drive, render_drive
from phase_traj_ros.synthetic.scene.scene import Scene
from phase_traj_ros.topics import camera_info_topic

#: The topics and coordinate frames of the ground truth and of the vehicle's speed.
TRUTH_TOPIC = '/ground_truth/pose'
SPEED_TOPIC = '/speed'
_MAP = 'map'
_CAMERA = 'camera'
_VEHICLE = 'base_link'

# The classes of the messages, by name.
_Types: TypeAlias = Mapping[str, Callable[..., Any]]


def write_drive_bag(
    drive: Drive, path: str | os.PathLike[str], *, image_topic: str = '/camera/image',
    scene: Scene | None = None, progress: Callable[[], object] | None = None,
) -> None:
    """
    Write a drive as a rosbag2 (a directory with an MCAP file).

    For each frame, with its stamp: ``sensor_msgs/Image`` (mono8) on ``image_topic``,
    ``sensor_msgs/CameraInfo`` on ``camera_info`` beside it, the true pose of the camera as
    ``geometry_msgs/PoseStamped`` on ``/ground_truth/pose`` (ROS axes, frame ``map``), and the
    speed from this frame to the next as ``geometry_msgs/TwistStamped`` on ``/speed``.

    ``scene`` is the scene of the drive, if it has been built already. ``progress`` is called after
    each frame. ``path`` must not exist. Raises `MissingDependencyError` if the rosbags library is
    not installed.
    """
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import get_typestore, Stores
    except ImportError as error:
        raise rosbags_missing('writing a bag', error) from error
    store = get_typestore(Stores.ROS2_JAZZY)
    with Writer(Path(path), version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        (images, infos, truth, speeds) = (
            writer.add_connection(topic, message_type, typestore=store)
            for (topic, message_type) in (
                (image_topic, 'sensor_msgs/msg/Image'),
                (camera_info_topic(image_topic), 'sensor_msgs/msg/CameraInfo'),
                (TRUTH_TOPIC, 'geometry_msgs/msg/PoseStamped'),
                (SPEED_TOPIC, 'geometry_msgs/msg/TwistStamped')))

        def write(connection: Any, stamp_ns: int, frame_id: str, **fields: Any) -> None:
            stamp = store.types['builtin_interfaces/msg/Time'](
                sec=stamp_ns // 10 ** 9, nanosec=stamp_ns % 10 ** 9)
            header = store.types['std_msgs/msg/Header'](stamp=stamp, frame_id=frame_id)
            message = store.types[connection.msgtype](header=header, **fields)
            writer.write(connection, stamp_ns, store.serialize_cdr(message, connection.msgtype))

        info, speed = _camera_info(store.types, drive.camera), _speeds(drive)
        vector = store.types['geometry_msgs/msg/Vector3']
        for (index, frame) in enumerate(render_drive(drive, scene=scene)):
            (height, width), stamp_ns = frame.shape, int(drive.stamps_ns[index])
            write(infos, stamp_ns, _CAMERA, **info)
            write(images, stamp_ns, _CAMERA, height=height, width=width, encoding='mono8',
                  is_bigendian=0, step=width, data=frame.reshape(-1))
            write(truth, stamp_ns, _MAP, pose=_pose(
                store.types, drive.pose(index), drive.camera.above_ground))
            write(speeds, stamp_ns, _VEHICLE, twist=store.types['geometry_msgs/msg/Twist'](
                linear=vector(x=speed[index], y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=0.0)))
            if progress is not None:
                progress()


def _camera_info(types: _Types, camera: Camera) -> dict[str, Any]:
    """Return the fields of the CameraInfo, without the header."""
    matrix, fisheye = camera.matrix(), camera.fisheye
    return {
        'height': camera.height, 'width': camera.width,
        'distortion_model': 'plumb_bob' if fisheye is None else 'equidistant',
        'd': np.zeros(5) if fisheye is None else np.array(fisheye),
        'k': matrix.ravel(), 'r': np.eye(3).ravel(),
        'p': np.concatenate([matrix, np.zeros((3, 1))], axis=1).ravel(),
        'binning_x': 0, 'binning_y': 0,
        'roi': types['sensor_msgs/msg/RegionOfInterest'](
            x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)}


def _pose(types: _Types, pose: Pose, height: float) -> Any:
    (x, y, z, w) = quaternion(pose)
    return types['geometry_msgs/msg/Pose'](
        position=types['geometry_msgs/msg/Point'](x=pose.x, y=pose.y, z=height),
        orientation=types['geometry_msgs/msg/Quaternion'](x=x, y=y, z=z, w=w))


def _speeds(drive: Drive) -> list[float]:
    """
    Return the speed from each frame to the next in m/s, negative in reverse.

    The last one is repeated.
    """
    steps, yaw = np.diff(drive.poses[:, :2], axis=0), drive.poses[:-1, 2]
    ahead = steps[:, 0] * np.cos(yaw) + steps[:, 1] * np.sin(yaw)
    speeds = np.copysign(np.hypot(*steps.T), ahead) / np.diff(drive.stamps_ns) * 1e9
    return [*speeds.tolist(), *speeds[-1:].tolist()] or [0.0]
