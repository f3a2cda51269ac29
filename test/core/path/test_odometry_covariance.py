# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How uncertain the odometry says it is."""

from dataclasses import replace
import math

from hypothesis import given, strategies as st
import numpy as np
from odometry_pairs import gone, step, TENTH
from phase_traj_ros.core.heading.tracker import HeadingStep
from phase_traj_ros.core.path.heading_path import HeadingPath
from phase_traj_ros.core.path.odometry import _YAW_SCALE, Odometer
from phase_traj_ros.core.road.travel import Travel, TravelState
import pytest

S = 10**9


def straight(pairs, **kwargs):
    odometer = Odometer(HeadingPath())
    for index in range(1, pairs + 1):
        found = odometer.update(step(0.0, 0.0), gone(1.0, **kwargs), index * TENTH, 0.1)
    return np.array(found.covariance)


def test_independent_errors_grow_with_the_root_of_the_way_and_common_ones_with_the_way():
    assert math.sqrt(straight(100)[0, 0]) == pytest.approx(0.05 * 10.0)
    assert math.sqrt(straight(100, scale=0.05)[0, 0]) == pytest.approx(0.05 * 100.0)
    # Those that last for a second lie between; within 10 s, those of a minute are common.
    assert 0.05 * 20.0 < math.sqrt(straight(100, swing=0.05)[0, 0]) < 0.05 * 60.0
    assert 0.05 * 90.0 < math.sqrt(straight(100, tilt=0.05)[0, 0]) < 0.05 * 100.0


@given(st.lists(st.tuples(st.floats(-0.1, 0.1), st.floats(-3, 3)), min_size=1, max_size=30))
def test_covariances_are_ones(pairs):
    odometer, heading, before = Odometer(HeadingPath()), 0.0, 0.0
    for index, (yaw, distance) in enumerate(pairs):
        heading += yaw
        now = odometer.update(
            step(yaw, heading), gone(distance, swing=0.02, tilt=0.03, scale=0.01),
            index * TENTH, 0.1)
        covariance = np.array(now.covariance)
        assert covariance == pytest.approx(covariance.T)
        assert np.linalg.eigvalsh(covariance).min() > -1e-9
        assert covariance[2, 2] > 0.0
        assert covariance[2, 2] > before or yaw != 0.0
        before = covariance[2, 2]


def test_the_covariance_is_what_drawn_errors_scatter_by():
    rng = np.random.default_rng(3)
    pairs, yaw, length = 60, math.radians(1.5), 0.8
    ends = []
    for _ in range(2000):
        scale = 1.0 + 0.04 * rng.normal()
        headings = np.cumsum(yaw + 0.004 * rng.normal(size=pairs))
        lengths = length * scale * (1.0 + 0.1 * rng.normal(size=pairs))
        middle = headings - np.diff(headings, prepend=0.0) / 2
        ends.append((*(lengths * (np.cos(middle), np.sin(middle))).sum(axis=1), headings[-1]))
    odometer = Odometer(HeadingPath())
    # Without what is unknown here: the mounting, and angles that are wrong all alike.
    odometer._covariance[:] = 0.0
    for index in range(1, pairs + 1):
        travel = Travel(
            length, (0.04 ** 2 + 0.1 ** 2) * length ** 2, TravelState.MEASURED, scale=0.04)
        # Half of a yaw's variance is taken to last: with intervals so long, it does not.
        found = odometer.update(
            step(yaw, index * yaw, deviation=0.004), travel, index * 100 * S, 100.0)
    drawn, told = np.cov(np.array(ends).T), np.array(found.covariance)
    for row, column in ((0, 0), (1, 1), (2, 2), (0, 2)):
        scatter = math.sqrt(drawn[row, row] * drawn[column, column])
        assert told[row, column] == pytest.approx(drawn[row, column], abs=0.12 * scatter)


BAND = (0.22, 9.35)


def simulated(rng, *, rate_hz, seconds=8.0, share=1.0):
    """
    Drive with all errors drawn from what the odometer expects; return NEES of pose and motion.

    The errors of the distance: of the height, of pitch and springs, and of the pair; of the yaw:
    of all angles, of objects seen for a quarter of a second, of the pair; and of the mounting.
    ``share`` is that of a pair in the time since its keyframe.
    """
    interval, odometer = 1.0 / rate_hz, Odometer(HeadingPath())
    height, swing, tilt, deviation, own = 0.04, 0.02, 0.01, 0.002, 0.02
    askew, angles = rng.normal(0.0, math.radians(0.5)), rng.normal(0.0, 0.01)
    scale, swings, tilts, seen = rng.normal(0.0, (height, swing, tilt, 0.0))
    length, rate, turning = 8.0 * interval, 0.0, rng.normal(0.0, 0.3)
    x = y = yaw = heading = 0.0
    for index in range(round(seconds * rate_hz)):
        rate += (turning - rate) * interval
        true = rate * interval
        middle = yaw + askew + true / 2
        x, y = x + length * math.cos(middle), y + length * math.sin(middle)
        yaw += true
        for kept, time in ((swing, 1.0), (tilt, 60.0)):
            lasts = math.exp(-interval / time)
            drawn = rng.normal(0.0, kept * math.sqrt(1.0 - lasts ** 2))
            if kept is swing:
                swings = lasts * swings + drawn
            else:
                tilts = lasts * tilts + drawn
        lasts = math.exp(-interval / 0.25)
        half = deviation / math.sqrt(2.0)
        seen = lasts * seen + rng.normal(0.0, half * math.sqrt(share * (1.0 - lasts ** 2)))
        # What is measured is the truth less these errors.
        measured = (true - seen - rng.normal(0.0, half)) / (1.0 + angles)
        gone = length * (1.0 - scale - swings - tilts - rng.normal(0.0, own))
        heading += measured
        variance = (height ** 2 + swing ** 2 + tilt ** 2 + own ** 2) * gone ** 2
        found = odometer.update(
            HeadingStep(
                measured, measured / interval, heading, False, deviation ** 2, share=share),
            Travel(gone, variance, TravelState.MEASURED, swing, tilt, height),
            round((index + 1) * interval * S), interval)
    error = np.array([found.pose.x - x, found.pose.y - y, found.pose.yaw - yaw])
    return (
        float(error @ np.linalg.solve(np.array(found.covariance), error)),
        (found.speed - length / interval) ** 2 / found.speed_variance,
        (found.yaw_rate - rate) ** 2 / found.yaw_rate_variance)


@pytest.mark.parametrize(('rate_hz', 'share'), [(10, 1.0), (40, 1.0), (40, 0.1)])
def test_poses_and_motions_scatter_as_they_say(rate_hz, share):
    rng = np.random.default_rng(rate_hz)
    pose, speed, rate = np.array([
        simulated(rng, rate_hz=rate_hz, share=share) for _ in range(80)]).T
    assert np.mean(pose) == pytest.approx(3.0, abs=0.8)
    assert np.mean((pose > BAND[0]) & (pose < BAND[1])) > 0.9
    assert np.mean(speed) == pytest.approx(1.0, abs=0.4)
    # Half of the variance of the pair, and the share of the other half.
    assert np.mean(rate) == pytest.approx((1.0 + share) / 2, abs=0.4)


def test_an_error_of_the_yaw_of_a_pair_moves_its_end_aside_by_half_its_length():
    odometer = Odometer(HeadingPath())
    odometer._covariance[:] = 0.0
    found = odometer.update(
        step(0.0, 0.0, deviation=0.01), Travel(4.0, 0.0, TravelState.MEASURED), TENTH, 0.1)
    aside = np.array([0.0, 2.0, 1.0])
    assert np.array(found.covariance) == pytest.approx(0.01 ** 2 * np.outer(aside, aside))


@pytest.mark.parametrize('yaw', [-1.0, 0.0, 0.6])
def test_an_error_of_the_distance_lies_along_the_way(yaw):
    odometer = Odometer(HeadingPath())
    odometer._covariance[:] = 0.0
    found = odometer.update(step(yaw, yaw, deviation=0.0), gone(3.0), TENTH, 0.1)
    along = np.array([found.pose.x, found.pose.y, 0.0]) / 3.0
    assert np.array(found.covariance) == pytest.approx((0.05 * 3.0) ** 2 * np.outer(along, along))


def test_the_yaw_is_as_certain_as_the_camera_and_a_turn_that_determines_it_corrects_it():
    odometer, odometry = Odometer(HeadingPath()), []
    for pair, scale in enumerate([0.3] * 10 + [0.03] * 10):
        turned = replace(step(0.1, 0.1 * (pair + 1)), scale=scale)
        odometry.append(odometer.update(turned, gone(1.0), (pair + 1) * TENTH, 0.1))
    assumed, learned = odometry[9], odometry[19]
    assert math.sqrt(assumed.covariance[2][2]) == pytest.approx(0.3 * 1.0, rel=0.05)
    assert math.sqrt(assumed.yaw_rate_variance) == pytest.approx(0.3 * 1.0, rel=0.05)
    assert math.sqrt(learned.covariance[2][2]) == pytest.approx(0.03 * 2.0, rel=0.1)
    assert math.sqrt(learned.yaw_rate_variance) == pytest.approx(math.hypot(0.03, 0.01), rel=0.1)
    # The heading is corrected, but not the places before.
    across = [each.covariance[1][1] for each in odometry]
    assert across[19] > across[9] > 0.1


@pytest.mark.parametrize('learned', ['angles', 'distances'])
def test_a_camera_that_is_learned_on_the_way_does_not_mend_the_places_before(learned):
    """Left, learned, left about and back, or in reverse: the errors hardly cancel."""
    yaws = np.repeat([0.0, 0.1, 0.0, 0.1, 0.0], [20, 16, 20, 31, 60])
    ways, at = np.ones(len(yaws)), 56
    if learned == 'distances':
        yaws, ways = np.zeros(len(yaws)), np.where(np.arange(len(yaws)) < at, 1.0, -1.0)
    rng, before, after = np.random.default_rng(0), 0.08, 0.02
    one = rng.normal(0.0, before, 4000)
    # By Bayes: their covariance is the variance of the better one.
    kept = (after / before) ** 2
    two = kept * one + rng.normal(0.0, after * math.sqrt(1.0 - kept), 4000)
    wrong = 1.0 + np.where(np.arange(len(yaws)) < at, one[:, None], two[:, None])
    heading = np.cumsum(yaws)
    turned, gone_too_far = (wrong, 1.0) if learned == 'angles' else (1.0, wrong)
    found = (ways * gone_too_far * np.exp(1j * (heading * turned - yaws / 2))).sum(axis=1)
    odometer = Odometer(HeadingPath())
    odometer._covariance[:] = 0.0
    odometer._covariance[_YAW_SCALE, _YAW_SCALE], odometer._scale = before ** 2, before
    for pair, (yaw, ahead, way) in enumerate(zip(yaws, heading, ways)):
        known = before if pair < at else after
        newest = odometer.update(
            replace(step(yaw, ahead, deviation=0.0), scale=known), Travel(
                way, 0.0, TravelState.MEASURED, scale=known * (learned == 'distances')),
            pair * TENTH, 0.1)
    told = np.sqrt(np.diag(newest.covariance)[:2])
    assert told == pytest.approx([found.real.std(), found.imag.std()], rel=0.15, abs=1e-9)


def test_speeds_that_come_and_go_do_not_make_the_height_certain():
    """Their errors and that of the height last, each on its own."""
    odometer = Odometer(HeadingPath())
    for pair in range(420):
        given = pair % 21 == 20
        # The height is learned a little from each speed.
        scale = 0.05 if given else 0.04 * 0.995 ** (pair // 21)
        found = odometer.update(
            step(0.0, 0.0, deviation=0.0), Travel(
                1.0, 0.0, TravelState.GIVEN if given else TravelState.MEASURED, scale=scale),
            pair * TENTH, 0.1)
    assert math.sqrt(found.covariance[0][0]) > 0.036 * 400.0
