# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How well lines that are drawn through points agree."""

import numpy as np


def off(points, line):
    """Return how far the farthest of the points (n, 2) is from a line through others (m, 2)."""
    places = np.linspace(0, len(line) - 1, 5000)
    dense = np.stack([np.interp(places, range(len(line)), each) for each in line.T], axis=1)
    return np.hypot(*(points[:, None] - dense[None]).transpose(2, 0, 1)).min(axis=1).max()
