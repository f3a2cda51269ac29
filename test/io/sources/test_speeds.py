# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Speeds from bags, in all supported messages."""

import numpy as np
from phase_traj_ros.io import open_source
import pytest

SECOND = 1_000_000_000
TWIST = 'geometry_msgs/msg/TwistStamped'
COVARIANT = 'geometry_msgs/msg/TwistWithCovarianceStamped'
ODOMETRY = 'nav_msgs/msg/Odometry'


def message(maker, msgtype, stamp_ns, speed):
    """Return a message of that type and speed."""
    types, zeros = maker.typestore.types, np.zeros(36)
    vector = types['geometry_msgs/msg/Vector3']
    twist = types['geometry_msgs/msg/Twist'](
        linear=vector(x=speed, y=0.5, z=0.0), angular=vector(x=0.0, y=0.0, z=0.1))
    header = maker.header(stamp_ns)
    if msgtype == TWIST:
        return types[TWIST](header=header, twist=twist)
    covariant = types['geometry_msgs/msg/TwistWithCovariance'](twist=twist, covariance=zeros)
    if msgtype == COVARIANT:
        return types[COVARIANT](header=header, twist=covariant)
    pose = types['geometry_msgs/msg/Pose'](
        position=types['geometry_msgs/msg/Point'](x=99.0, y=0.0, z=0.0),
        orientation=types['geometry_msgs/msg/Quaternion'](x=0.0, y=0.0, z=0.0, w=1.0))
    return types[ODOMETRY](
        header=header, child_frame_id='base_link', twist=covariant,
        pose=types['geometry_msgs/msg/PoseWithCovariance'](pose=pose, covariance=zeros))


@pytest.mark.parametrize('msgtype', [TWIST, COVARIANT, ODOMETRY])
def test_by_the_stamp(tmp_path, maker, drive_frame, msgtype):
    path = maker.write(tmp_path / 'bag', {
        '/image': ('sensor_msgs/msg/Image', [(SECOND, maker.image(drive_frame(0), SECOND))]),
        '/speed': (msgtype, [
            # The last has no stamp.
            (SECOND + 7, message(maker, msgtype, SECOND, 8.0)),
            (2 * SECOND + 7, message(maker, msgtype, 2 * SECOND, float('nan'))),
            (3 * SECOND + 7, message(maker, msgtype, 0, -1.5))])})
    with open_source(path) as source:
        speeds = [(each.stamp_ns, each.speed) for each in source.speeds('speed')]
    assert speeds == [(SECOND, 8.0), (3 * SECOND + 7, -1.5)]
