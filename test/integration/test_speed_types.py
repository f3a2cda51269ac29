# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The vehicle's speed in each of the messages that tell it."""

from functools import partial

from geometry_msgs.msg import TwistWithCovarianceStamped
from live import image
from nav_msgs.msg import Odometry
import numpy as np
from phase_traj_ros.ros.outputs.messages import MESSAGES
import pytest

SECOND = 1_000_000_000


def test_odometry_has_the_speed_also_of_a_publisher_of_another_type(live):
    process = live.start('-p', 'use_speed_topic:=true', '-p', 'hfov_deg:=80.0')
    camera = live.camera()
    odometry = live.listen(Odometry, 'phase_traj/odom')
    texture = np.random.default_rng(0).integers(0, 256, (96, 160), np.uint8)
    sent = 0

    def answered(kind, speed, given):
        # Who publishes odom may know this subscriber a moment later than it knows the camera.
        nonlocal sent
        message = kind()
        message.header.stamp = MESSAGES.time((sent + 10) * SECOND // 10)
        message.twist.twist.linear.x = given
        speed.publish(message)
        # The same picture again would be a camera that repeats it, not a pair.
        camera.publish(image(np.roll(texture, 2 * sent, axis=1), (sent + 10) * SECOND // 10))
        sent += 1
        live.spin(0.05)
        return odometry and odometry[-1].twist.twist.linear.x == pytest.approx(given)

    for kind, given in ((TwistWithCovarianceStamped, 7.0), (Odometry, 4.0)):
        speed = live.camera('/speed', kind=kind)
        live.until(partial(answered, kind, speed, given), process=process)
        live.node.destroy_publisher(speed)
