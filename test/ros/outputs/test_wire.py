# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A path that is serialised here is the one that ROS reads."""

from nav_msgs.msg import Path
from phase_traj_ros.core import Corner
from phase_traj_ros.io.messages.published import Messages
from phase_traj_ros.ros.outputs.messages import MESSAGES
import pytest
from rclpy.serialization import deserialize_message

STAMP = 1_700_000_000 * 10**9 + 123


# The length of the name decides how the poses are aligned.
@pytest.mark.parametrize('frame', ['', 'odom', 'phase', 'phase_traj', 'a/longer/name', 'ö' * 4])
@pytest.mark.parametrize('poses', [0, 1, 2, 50])
@pytest.mark.parametrize('stamp', [STAMP, -100 * 10**9 + 1])
def test_a_path(frame, poses, stamp):
    points = [
        Corner(0.1 * index, -2.0 * index, index / 7 - 3, stamp + index * 10**8)
        for index in range(poses)]
    header = MESSAGES.header(stamp, frame)
    read = deserialize_message(MESSAGES.path(points, header), Path)
    assert read == Messages.path(MESSAGES, points, header)
