# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The roads of a drive's town."""

from itertools import pairwise

import numpy as np
from phase_traj_ros.synthetic import named_drive, pose_drive, town_drive
import pytest


def distance_off(points, lines):
    """Return the largest distance of points (N, 2) from the nearest line."""
    nearest = np.full(len(points), np.inf)
    for line in lines:
        for start, end in pairwise(line):
            along = end - start
            share = ((points - start) @ along / (along @ along)).clip(0.0, 1.0)
            off = points - start - share[:, None] * along
            nearest = np.minimum(nearest, np.hypot(*off.T))
    return nearest.max()


@pytest.mark.parametrize('make', [
    lambda: named_drive('demo'), town_drive,
    lambda: pose_drive('curve', [(x, x * x / 200.0, x / 100.0) for x in range(100)])])
def test_a_drive_is_on_the_roads_of_its_town(make):
    drive = make()

    # Corners of a grid are cut.
    assert distance_off(drive.poses[:, :2], drive.build_roads()) < 5.0


@pytest.mark.parametrize('make', [lambda: named_drive('demo'), town_drive])
def test_the_roads_of_a_town_meet(make):
    lines = make().build_roads()
    points = [{tuple(point) for point in np.round(line, 3).tolist()} for line in lines]

    for number, own in enumerate(points):
        assert any(own & other for place, other in enumerate(points) if place != number)
