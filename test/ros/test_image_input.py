# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""From the message of an image to the frame of the estimator."""

from unittest.mock import MagicMock

import numpy as np
from phase_traj_ros.core.frames.prepare import prepare
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.health import Health
from phase_traj_ros.ros.inputs.image import ImageInput
from sensor_msgs.msg import Image


def test_the_data_of_a_grey_image_are_not_copied():
    node, entities, frames = MagicMock(), MagicMock(), []
    node.get_clock().now().nanoseconds = 0
    node.resolve_topic_name.return_value = '/image'
    ImageInput(node, entities, Parameters(), Health(), on_frame=frames.append,
               on_undecodable=MagicMock())
    receive = entities.create_subscription.call_args.args[2]
    message = Image(height=16, width=24, step=24, encoding='mono8', data=bytes(16 * 24))
    receive(message, {'publication_sequence_number': None, 'received_timestamp': 0})
    assert np.shares_memory(prepare(frames[0].image), np.frombuffer(message.data, np.uint8))
