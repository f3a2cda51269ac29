# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""True poses of the KITTI odometry benchmark, in ROS axes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.synthetic.arrays import Floats
from phase_traj_ros.synthetic.camera import BODY_TO_PICTURE


def poses_from_kitti(matrices: npt.ArrayLike) -> Floats:
    """
    Return KITTI poses as x, y, yaw, pitch, roll, (N, 5).

    ``matrices`` is (N, 12), the lines of a KITTI pose file: 3 x 4 camera to world, row-major, with
    x to the right, y down, z forward, metres. The result is in metres and radians in REP 103
    axes: x is KITTI's z, y its -x. The height is dropped, and yaw is not wrapped. Raises
    `ParameterError` for another shape.
    """
    given = np.asarray(matrices, np.float64)
    if given.ndim != 2 or given.shape[1] != 12 or not np.isfinite(given).all():
        raise ParameterError(
            'KITTI poses are lines of 12 finite numbers (3 x 4 camera to world), not an array '
            f'of shape {given.shape}')
    camera_to_world = given.reshape(-1, 3, 4)
    turned = BODY_TO_PICTURE.T @ camera_to_world[:, :, :3] @ BODY_TO_PICTURE
    yaw = np.unwrap(np.arctan2(turned[:, 1, 0], turned[:, 0, 0]))
    pitch = -np.arcsin(np.clip(turned[:, 2, 0], -1.0, 1.0))
    roll = np.arctan2(turned[:, 2, 1], turned[:, 2, 2])
    place = camera_to_world[:, :, 3] @ BODY_TO_PICTURE
    return np.stack([place[:, 0], place[:, 1], yaw, pitch, roll], axis=1)
