# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Directions to vertices."""

from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.core import Axes, ChainPath, Direction, Freeman, normalised, vertices, yaw
import pytest

DIRECTIONS = st.lists(st.sampled_from(Direction), max_size=40)


@pytest.mark.parametrize(('direction', 'figure', 'rep103'), [
    (1, (0, 1), (1, 0)), (0, (-1, 0), (0, 1)), (2, (1, 0), (0, -1)), (3, (0, -1), (-1, 0))])
def test_a_step_in_both_axes(direction, figure, rep103):
    assert vertices([direction], axes=Axes.FIGURE)[1].tolist() == list(figure)
    assert vertices([direction])[1].tolist() == list(rep103)
    angle = yaw(Direction(direction))
    assert (np.cos(angle), np.sin(angle)) == pytest.approx(rep103)


def test_freemans_steps_are_of_length_one_and_go_round_counter_clockwise():
    steps = vertices(range(8), codes=Freeman)[1:] - vertices(range(8), codes=Freeman)[:-1]
    assert np.hypot(*steps.T) == pytest.approx(np.ones(8))
    angles = [yaw(code) for code in sorted(Freeman)]
    assert np.diff(np.unwrap(angles)) == pytest.approx(np.full(7, np.pi / 4))
    assert np.arctan2(steps[:, 1], steps[:, 0]) == pytest.approx(angles)
    assert yaw(Freeman.FORWARD) == 0.0
    assert all(-np.pi < angle <= np.pi for angle in angles)


def test_a_drive_around_a_block_returns_to_the_start():
    points = vertices([1, 1, 2, 2, 3, 3, 0, 0])
    assert points.shape == (9, 2)
    assert points[-1].tolist() == [0, 0]


def test_nothing_is_a_point():
    assert vertices([]).tolist() == [[0, 0]]
    assert normalised(vertices([])).tolist() == [[0, 0]]


def test_a_code_that_is_no_direction_is_refused():
    with pytest.raises(ValueError, match='4'):
        vertices([1, 4])
    with pytest.raises(ValueError, match='8'):
        vertices([1, 8], codes=Freeman)


@given(DIRECTIONS)
def test_normalised_starts_at_the_origin_with_a_longer_side_of_one(directions):
    points = normalised(vertices(directions, axes=Axes.FIGURE))
    assert points[0].tolist() == [0, 0]
    if directions:
        extent = np.ptp(points, axis=0)
        assert extent.max() == pytest.approx(1)
        lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        assert lengths == pytest.approx(lengths[0])


def test_normalised_moves_the_start_to_the_origin():
    points = np.array([[3.0, 4.0], [5.0, 4.0], [5.0, 3.0]])
    assert normalised(points).tolist() == [[0, 0], [1, 0], [1, -0.5]]


@given(DIRECTIONS)
def test_the_growing_path_has_the_corners_of_the_drawn_one(directions):
    path = ChainPath()
    path.start(0)
    for index, direction in enumerate(directions):
        path.append(direction, index + 1)
    drawn = vertices(directions)
    assert (path.tip.x, path.tip.y) == tuple(drawn[-1])
    changes = [0] + [
        index for index in range(1, len(directions)) if directions[index] != directions[index - 1]]
    assert [(each.x, each.y) for each in path.corners] == [tuple(drawn[each]) for each in changes]
    assert [each.stamp_ns for each in path.corners] == changes
    if directions:
        assert [each.yaw for each in path.corners] == [yaw(directions[each]) for each in changes]


def test_a_bounded_path_keeps_the_newest_corners():
    path = ChainPath(max_corners=3)
    for index, direction in enumerate([1, 2, 1, 2, 1]):
        path.append(Direction(direction), index)
    assert [(each.x, each.y) for each in path.corners] == [(1, -1), (2, -1), (2, -2)]
    assert (path.tip.x, path.tip.y) == (3, -2)


@pytest.mark.parametrize('limit', [2, 4, 50])
def test_a_path_is_shown_by_its_newest_corners_and_its_tip(limit):
    path = ChainPath()
    assert path.points(limit) == ()
    for index in range(20):
        path.append((Direction.FORWARD, Direction.RIGHT)[index % 2], index)
    every = (*path.corners, path.tip)
    assert path.points(limit) == every[-limit:] and path.points(limit)[-1] == path.tip
