# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Distance between polylines."""

import numpy as np


def off(points, line):
    """Return the largest distance of points (n, 2) from a line through others (m, 2)."""
    places = np.linspace(0, len(line) - 1, 5000)
    dense = np.stack([np.interp(places, range(len(line)), each) for each in line.T], axis=1)
    return np.hypot(*(points[:, None] - dense[None]).transpose(2, 0, 1)).min(axis=1).max()
