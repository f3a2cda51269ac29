# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Errors of odometry, against values calculated by hand."""

import numpy as np
from phase_traj_ros.tasks.evaluation.scores import (
    absolute_error,
    distance_error,
    relative_errors,
)
import pytest


def poses(lengths, yaws):
    """Return the poses after steps, (n, 3): lengths in metres, yaws in radians, half before."""
    yaw = np.concatenate([[0.0], np.cumsum(yaws)])
    middle = (yaw[1:] + yaw[:-1]) / 2
    steps = np.stack([lengths * np.cos(middle), lengths * np.sin(middle)], axis=1)
    places = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    return np.column_stack([places, yaw])


def straight(metres, *, step=1.0, yaw=0.0):
    count = round(metres / step)
    return poses(np.full(count, step), np.full(count, yaw))


def starts(metres, length):
    """Return how many parts of a length begin at every 10th of steps of 1 m."""
    return max((metres - length) // 10 + 1, 0)


@pytest.mark.parametrize('factor', [0.95, 1.05, 1.0])
@pytest.mark.parametrize('metres', [130, 420, 1000])
def test_a_wrong_scale(metres, factor):
    true = straight(metres)
    found = straight(metres) * (factor, factor, 1.0)
    assert distance_error(found[:, :2], true[:, :2]) == pytest.approx(factor - 1.0)
    errors = relative_errors(found, true)
    assert errors.translation == pytest.approx(abs(factor - 1.0), abs=1e-12)
    assert errors.rotation == 0.0


@pytest.mark.parametrize('step', [0.37, 1.0, 3.1])
def test_a_scale_is_a_share_of_the_way_at_any_speed(step):
    true = straight(600, step=step)
    errors = relative_errors(true * (1.05, 1.05, 1.0), true)
    assert errors.translation == pytest.approx(0.05)


@pytest.mark.parametrize('metres', [150, 300])
def test_a_constant_error_of_the_yaw_rate(metres):
    rate = np.radians(0.02)
    errors = relative_errors(straight(metres, yaw=rate), straight(metres))
    assert np.degrees(errors.rotation) * 100 == pytest.approx(2.0)
    # Along a circle instead of its tangent.
    parts = [(length, starts(metres, length))
             for length in ((50, 100) if metres < 200 else (100, 200, 300))]
    off = [
        abs((np.exp(1j * rate * length) - 1) / (1j * rate) - length) / length
        for length, _ in parts]
    expected = np.average(off, weights=[count for _, count in parts])
    assert errors.translation == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(('metres', 'lengths'), [
    (50, (50,)), (150, (50, 100)), (199, (50, 100)), (200, (100, 200)),
    (950, range(100, 900, 100)), (1200, range(100, 900, 100))])
def test_which_parts_count(metres, lengths):
    true = straight(metres)
    found = true.copy()
    # A jump within the parts that begin at the first two starts only.
    found[15:, 1] += 1.0
    parts = [starts(metres, length) for length in lengths]
    seen = [min(count, 2) / length for count, length in zip(parts, lengths)]
    assert relative_errors(found, true).translation == pytest.approx(sum(seen) / sum(parts))


def test_the_origin_and_full_turns_do_not_matter():
    rng = np.random.default_rng(3)
    true = poses(rng.uniform(0.5, 1.5, 400), rng.normal(0, 0.05, 400))
    found = true + rng.normal(0, 0.02, true.shape).cumsum(axis=0)
    expected = relative_errors(found, true)
    sine, cosine = np.sin(2.0), np.cos(2.0)
    moved = np.column_stack([
        found[:, :2] @ np.array([[cosine, sine], [-sine, cosine]]) + (7.0, -3.0),
        np.angle(np.exp(1j * (found[:, 2] + 2.0)))])
    errors = relative_errors(moved, true)
    assert expected.translation > 0.001
    assert errors.translation == pytest.approx(expected.translation)
    assert errors.rotation == pytest.approx(expected.rotation)


def test_reversing_counts_as_distance():
    there_and_back = poses(np.array([1.0] * 30 + [-1.0] * 30), np.zeros(60))[:, :2]
    assert distance_error(there_and_back, straight(60)[:, :2]) == pytest.approx(0.0)


def test_without_motion_there_are_no_errors():
    assert distance_error(straight(60)[:, :2], np.zeros((61, 2))) is None
    assert relative_errors(straight(60), np.zeros((61, 3))) is None
    assert relative_errors(straight(49), straight(49)) is None


def test_absolute_errors():
    true = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 100.0], [0.0, 100.0]])
    turned = 1.05 * true @ np.array([[0.0, 1.0], [-1.0, 0.0]]) + (5.0, 6.0)
    assert absolute_error(turned, true) == pytest.approx(0.0, abs=1e-9)
    # Each corner is 5 % further from the middle.
    assert absolute_error(turned, true, scaled=False) == pytest.approx(0.05 * np.hypot(50, 50))
    mirrored = true * (1, -1)
    assert absolute_error(mirrored, true, scaled=False) > 10.0
    # A path that does not move cannot be rotated.
    assert absolute_error(np.zeros((4, 2)), true, scaled=False) == pytest.approx(np.hypot(50, 50))
