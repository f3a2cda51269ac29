# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages that are serialised here are those that ROS reads."""

from nav_msgs.msg import Path
import numpy as np
from phase_traj_ros.core import Corner
from phase_traj_ros.ros.outputs.messages import MESSAGES
from phase_traj_ros.ros.outputs.wire import path_bytes, picture_bytes
import pytest
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Image

STAMP = 1_700_000_000 * 10**9 + 123


# The length of the name decides how the poses are aligned.
@pytest.mark.parametrize('frame', ['', 'odom', 'phase', 'phase_traj', 'a/longer/name', 'ö' * 4])
@pytest.mark.parametrize('poses', [0, 1, 2, 50])
def test_a_path(frame, poses):
    points = [
        Corner(0.1 * index, -2.0 * index, index / 7 - 3, STAMP + index * 10**8)
        for index in range(poses)]
    read = deserialize_message(path_bytes(points, STAMP, frame), Path)
    assert read == MESSAGES.path(points, MESSAGES.header(STAMP, frame))


@pytest.mark.parametrize('frame', ['', 'camera', 'camera_optical_frame'])
def test_a_picture(frame):
    picture = np.random.default_rng(0).integers(0, 256, (7, 5, 3), np.uint8)[:, ::-1]
    read = deserialize_message(picture_bytes(picture, STAMP, frame), Image)
    assert read.header == MESSAGES.header(STAMP, frame)
    assert (read.height, read.width, read.step, read.encoding) == (7, 5, 15, 'bgr8')
    assert bytes(read.data) == picture.tobytes()
