# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Images as messages of rclpy: of all types of samples, also where these are not contiguous."""

import numpy as np
from phase_traj_ros.io import to_grey
from phase_traj_ros.ros.outputs.messages import MESSAGES
import pytest

STAMP = 1_700_000_000 * 10**9 + 123
HEADER = MESSAGES.header(STAMP, 'camera')


@pytest.mark.parametrize('samples', [np.uint8, np.uint16, np.float32, '>u2'])
def test_a_grey_image_is_read_as_it_was(samples):
    image = (np.arange(70).reshape(7, 10) * 3.0).astype(samples)[:, ::2]
    message = MESSAGES.image(image, HEADER)
    assert message.header == HEADER
    assert (to_grey(message) == image).all()


def test_a_picture():
    picture = np.random.default_rng(0).integers(0, 256, (7, 5, 3), np.uint8)[:, ::-1]
    message = MESSAGES.image(picture, HEADER)
    assert (message.height, message.width, message.step) == (7, 5, 15)
    assert message.encoding == 'bgr8' and bytes(message.data) == picture.tobytes()
