# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The way from speeds, and the odometry from heading and way."""

from dataclasses import replace
import math

from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.core.heading.tracker import HeadingStep, HeadingTracker
from phase_traj_ros.core.path.odometry import _ANGLES, Odometer
from phase_traj_ros.core.path.speed import SpeedTrack
from phase_traj_ros.core.road.travel import Travel, TravelState
import pytest

S = 10**9
TENTH = S // 10


def track(*samples):
    made = SpeedTrack()
    for seconds, speed in samples:
        made.add(round(seconds * S), speed)
    return made


def test_a_speed_holds_until_the_next_one():
    speeds = track((0.0, 1.0), (0.5, 3.0))
    assert speeds.distance(0, S) == pytest.approx(0.5 * 1.0 + 0.5 * 3.0)


def test_parts_add_up_to_the_whole():
    samples = [(0.1 * index, float(index % 5)) for index in range(30)]
    whole = track(*samples).distance(S, 2 * S)
    speeds = track(*samples)
    parts = [speeds.distance(S + 7 * step, S + 7 * (step + 1)) for step in range(S // 7 // 100)]
    assert None not in parts
    cuts = [S + S * index // 33 for index in range(34)]
    speeds = track(*samples)
    assert sum(map(speeds.distance, cuts, cuts[1:])) == pytest.approx(whole)


def test_the_first_speed_holds_for_what_was_just_before_it():
    assert track((0.05, 4.0)).distance(0, TENTH) == pytest.approx(0.4)
    assert track((2.6, 4.0)).distance(0, 3 * S) is None


@pytest.mark.parametrize('samples', [[], [(5.0, 1.0)], [(-2.6, 1.0)], [(0.0, 1.0), (3.0, 1.0)]])
def test_nothing_is_made_of_speeds_that_do_not_hold(samples):
    assert track(*samples).distance(0, 4 * S if len(samples) > 1 else TENTH) is None


def test_one_speed_a_second_is_enough():
    rng = np.random.default_rng(0)
    speeds = track(*((index + rng.uniform(-0.1, 0.1), 8.0) for index in range(60)))
    ways = [speeds.distance(index * TENTH, (index + 1) * TENTH) for index in range(600)]
    assert None not in ways
    assert sum(ways) == pytest.approx(480)


def test_equal_stamps_and_any_order_when_sorted():
    samples = sorted([(0.0, 1.0), (0.05, 3.0)] * 3)
    assert track(*samples).distance(0, TENTH) == pytest.approx(0.05 + 0.15)


def test_reversing_goes_back():
    assert track((0.0, -2.0)).distance(0, TENTH) == pytest.approx(-0.2)


def test_a_stamp_that_goes_back_starts_anew():
    speeds = track((10.0, 5.0), (0.0, 1.0))
    assert speeds.distance(0, TENTH) == pytest.approx(0.1)


@pytest.mark.parametrize('speed', [math.nan, math.inf, -math.inf, 1e200, -1000.1])
def test_a_speed_can_be_one(speed):
    speeds = track((0.0, 1.0))
    with pytest.raises(ValueError, match='speed is'):
        speeds.add(1, speed)
    assert speeds.distance(0, TENTH) == pytest.approx(0.1)


def test_it_stays_bounded_whether_it_is_asked_or_not():
    speeds = SpeedTrack(max_speeds=50)
    for stamp in range(0, 1000 * TENTH, TENTH // 10):
        speeds.add(stamp, 1.0)
        if stamp % TENTH == 0 and stamp > 500 * TENTH:
            assert speeds.distance(stamp - TENTH, stamp) == pytest.approx(0.1)
        assert len(speeds._stamps) <= 100
    assert speeds.newest_ns == stamp


def step(yaw, heading, *, deviation=0.001):
    return HeadingStep(yaw, yaw / 0.1, heading, False, deviation ** 2)


def gone(distance, *, share=0.05, **alike):
    return Travel(distance, (share * distance) ** 2, TravelState.MEASURED, **alike)


def test_a_quarter_circle():
    odometer, yaw = Odometer(), math.pi / 2 / 90
    radius = 10.0
    for index in range(1, 91):
        found = odometer.update(
            step(yaw, index * yaw), gone(radius * yaw), index * TENTH, 0.1)
    assert (found.pose.x, found.pose.y) == pytest.approx((radius, radius), rel=1e-3)
    assert found.pose.yaw == pytest.approx(math.pi / 2)
    assert found.speed == pytest.approx(radius * yaw / 0.1)
    assert found.yaw_rate == pytest.approx(yaw / 0.1)


def straight(pairs, **kwargs):
    odometer = Odometer()
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
    odometer, heading, before = Odometer(), 0.0, 0.0
    for index, (yaw, distance) in enumerate(pairs):
        heading += yaw
        now = odometer.update(
            step(yaw, heading), gone(distance, swing=0.02, tilt=0.03, scale=0.01),
            index * TENTH, 0.1)
        covariance = np.array(now.covariance)
        assert covariance == pytest.approx(covariance.T)
        assert np.linalg.eigvalsh(covariance).min() > -1e-9
        assert covariance[2, 2] == now.yaw_variance > 0.0
        assert np.trace(covariance[:2, :2]) / 2 == pytest.approx(now.position_variance)
        assert now.yaw_variance > before or yaw != 0.0
        before = now.yaw_variance


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
    odometer = Odometer()
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


def simulated(rng, *, rate_hz, seconds=8.0, odometer=None, share=1.0):
    """
    Drive with all errors drawn from what the odometer expects; return NEES of pose and motion.

    The errors of the distance: of the height, of pitch and springs, and of the pair; of the yaw:
    of all angles, of objects seen for a quarter of a second, of the pair; and of the mounting.
    ``share`` is that of a pair in the time since its keyframe.
    """
    interval, odometer = 1.0 / rate_hz, odometer or Odometer()
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
        simulated(rng, rate_hz=rate_hz, share=share) for _ in range(160)]).T
    assert np.mean(pose) == pytest.approx(3.0, abs=0.8)
    assert np.mean((pose > BAND[0]) & (pose < BAND[1])) > 0.9
    assert np.mean(speed) == pytest.approx(1.0, abs=0.4)
    # Half of the variance of the pair, and the share of the other half.
    assert np.mean(rate) == pytest.approx((1.0 + share) / 2, abs=0.4)


def test_they_do_so_again_after_a_reset():
    rng, odometer = np.random.default_rng(5), Odometer()
    poses = []
    for _ in range(150):
        poses.append(simulated(rng, rate_hz=10, odometer=odometer)[0])
        odometer.reset()
    assert np.mean(poses) == pytest.approx(3.0, abs=0.8)


@pytest.mark.parametrize('rate_hz', [10, 30])
@pytest.mark.parametrize('seconds', [0.3, 0.7, 1.5])
def test_a_correction_after_a_covered_lens_is_no_motion(rate_hz, seconds):
    """The lens is covered while a turn begins."""
    interval, tracker, odometer = 1.0 / rate_hz, HeadingTracker(), Odometer()
    covered = range(rate_hz, rate_hz + round(seconds * rate_hz))
    top = min(60.0 * seconds, 40.0)
    rates = [0.0] * rate_hz + np.linspace(0, top, len(covered)).tolist() + [top] * rate_hz
    for index, rate in enumerate(rates):
        yaw = None if index in covered else math.radians(rate) * interval
        turned = tracker.update(yaw, interval, variance=math.radians(0.02) ** 2)
        found = odometer.update(
            turned, gone(8.0 * interval), round((index + 1) * interval * S), interval)
        off = abs(found.yaw_rate - math.radians(rate))
        assert off < 3.0 * math.sqrt(found.yaw_rate_variance)
        if not turned.bridged:
            assert found.yaw_rate == pytest.approx(math.radians(rate))
            assert math.sqrt(found.yaw_rate_variance) < 0.1
    off = abs(found.pose.yaw - math.radians(sum(rates)) * interval)
    assert off < 3.0 * math.sqrt(found.yaw_variance)
    assert seconds > 1.0 or off < 0.05


def test_a_foreseen_frame_has_the_errors_of_what_is_foreseen_and_changes_nothing():
    odometer, other = Odometer(), Odometer()
    ahead = HeadingStep(0.0, 0.0, 0.0, False, 0.002 ** 2, foreseen=0.01)
    assert odometer.foresee(ahead, gone(1.0), TENTH, 0.1) is None
    for each in (odometer, other):
        newest = each.update(step(0.0, 0.0), gone(1.0), TENTH, 0.1)
    seen = odometer.foresee(ahead, Travel(0.5, 0.3 ** 2, TravelState.BRIDGED), 2 * TENTH, 0.1)
    assert (seen.pose.x, seen.pose.y) == pytest.approx((newest.pose.x + 0.5, 0.0))
    grown = np.array(seen.covariance) - np.array(newest.covariance)
    assert grown == pytest.approx(np.diag([0.3 ** 2, 0.3 ** 2, 0.002 ** 2 + 0.01 ** 2]))
    assert seen.position_variance - newest.position_variance == pytest.approx(0.3 ** 2)
    assert seen.yaw_variance == seen.covariance[2][2]
    # Off by a hundredth of a radian in a tenth of a second.
    assert seen.yaw_rate_variance - newest.yaw_rate_variance == pytest.approx(0.1 ** 2)
    after, expected = (
        each.update(step(0.0, 0.0), gone(1.0), 2 * TENTH, 0.1) for each in (odometer, other))
    assert after == expected


def test_nothing_that_is_measured_is_exact():
    stood = Travel(0.0, 0.0, TravelState.STANDING)
    found = Odometer().update(step(0.0, 0.0, deviation=0.0), stood, TENTH, 0.1)
    # A picture shows whether a vehicle creeps, but not that nothing moves at all.
    assert 0.002 < math.sqrt(found.speed_variance) < 0.05
    assert 0.002 < math.degrees(math.sqrt(found.yaw_rate_variance)) < 0.05


def test_an_error_of_the_yaw_of_a_pair_moves_its_end_aside_by_half_its_length():
    odometer = Odometer()
    odometer._covariance[:] = 0.0
    found = odometer.update(
        step(0.0, 0.0, deviation=0.01), Travel(4.0, 0.0, TravelState.MEASURED), TENTH, 0.1)
    aside = np.array([0.0, 2.0, 1.0])
    assert np.array(found.covariance) == pytest.approx(0.01 ** 2 * np.outer(aside, aside))


@pytest.mark.parametrize('yaw', [-1.0, 0.0, 0.6])
def test_an_error_of_the_distance_lies_along_the_way(yaw):
    odometer = Odometer()
    odometer._covariance[:] = 0.0
    found = odometer.update(step(yaw, yaw, deviation=0.0), gone(3.0), TENTH, 0.1)
    along = np.array([found.pose.x, found.pose.y, 0.0]) / 3.0
    assert np.array(found.covariance) == pytest.approx((0.05 * 3.0) ** 2 * np.outer(along, along))


def test_what_is_not_known_of_the_way_is_an_error_of_the_pose():
    odometer, sure = Odometer(), Odometer()
    for each in (odometer, sure):
        each.update(step(0.0, 0.0), gone(1.0), TENTH, 0.1)
    for _ in range(30):
        odometer.update(
            step(0.0, 0.0), Travel(0.0, 1.5 ** 2, TravelState.UNKNOWN), TENTH, 0.1)
    lost = odometer.update(step(0.0, 0.0), gone(1.0), 40 * TENTH, 0.1)
    known = sure.update(step(0.0, 0.0), gone(1.0), 2 * TENTH, 0.1)
    assert lost.pose.x == known.pose.x == 2.0
    # It may have been in one direction, in all pairs.
    assert math.sqrt(lost.position_variance) == pytest.approx(30 * 1.5, rel=0.01)
    assert math.sqrt(known.position_variance) < 2.0


def test_the_speed_after_a_gap_tells_how_far_a_vehicle_may_have_gone_in_it():
    """A robot that drives 0.3 m/s was not 15 m/s fast a tenth of a second before."""
    odometer, deviations = Odometer(), []
    for speed, gap in ((0.3, 0.1), (0.3, 0.1), (0.3, 2.0), (-10.0, 0.1)):
        missed = Travel(0.0, (15.0 * gap) ** 2, TravelState.UNKNOWN)
        odometer.update(step(0.0, 0.0, deviation=0.0), missed, TENTH, gap)
        found = odometer.update(
            step(0.0, 0.0, deviation=0.0), gone(0.1 * speed, share=0.0), TENTH, 0.1)
        deviations.append(math.sqrt(found.position_variance))
    # What is missing is missing in one direction, so that gaps add up.
    once, twice, long, fast = np.diff([0.0, *deviations])
    assert 0.03 < once < 0.1 and twice == pytest.approx(once, rel=0.01)
    assert 2 * 0.3 + 3.0 < long < 15.0 * 2.0
    assert 1.0 < fast < 1.5


def test_a_pair_that_is_missed_turns_but_goes_nowhere():
    odometer = Odometer()
    before = odometer.update(step(0.0, 0.0), gone(1.0), TENTH, 0.1)
    odometer.update(step(0.3, 0.3), Travel(5.0, 0.0, TravelState.UNKNOWN), 2 * TENTH, 0.1)
    after = odometer.update(step(0.0, 0.3), gone(0.0), 3 * TENTH, 0.1)
    assert (after.pose.x, after.pose.y, after.pose.yaw) == pytest.approx(
        (before.pose.x, before.pose.y, 0.3))
    assert np.array(after.covariance)[:2, :2] == pytest.approx(
        np.array(before.covariance)[:2, :2])
    assert after.yaw_variance > before.yaw_variance


def test_the_yaw_is_as_certain_as_the_camera_and_a_turn_that_determines_it_corrects_it():
    odometer, odometry = Odometer(), []
    for pair, scale in enumerate([0.3] * 10 + [0.03] * 10):
        turned = replace(step(0.1, 0.1 * (pair + 1)), scale=scale)
        odometry.append(odometer.update(turned, gone(1.0), (pair + 1) * TENTH, 0.1))
    assumed, learned = odometry[9], odometry[19]
    assert math.sqrt(assumed.yaw_variance) == pytest.approx(0.3 * 1.0, rel=0.05)
    assert math.sqrt(assumed.yaw_rate_variance) == pytest.approx(0.3 * 1.0, rel=0.05)
    assert math.sqrt(learned.yaw_variance) == pytest.approx(0.03 * 2.0, rel=0.1)
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
    odometer = Odometer()
    odometer._covariance[:] = 0.0
    odometer._covariance[_ANGLES, _ANGLES], odometer._scale = before ** 2, before
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
    odometer = Odometer()
    for pair in range(420):
        given = pair % 21 == 20
        # The height is learned a little from each speed.
        scale = 0.05 if given else 0.04 * 0.995 ** (pair // 21)
        found = odometer.update(
            step(0.0, 0.0, deviation=0.0), Travel(
                1.0, 0.0, TravelState.GIVEN if given else TravelState.MEASURED, scale=scale),
            pair * TENTH, 0.1)
    assert math.sqrt(found.covariance[0][0]) > 0.036 * 400.0


def test_a_vehicle_that_stands_does_not_turn():
    driving, standing = Odometer(), Odometer()
    stood = Travel(0.0, 0.0, TravelState.STANDING)
    for index in range(100):
        drove = driving.update(step(0.0, 0.0), gone(1.0), index * TENTH, 0.1)
        stays = standing.update(step(0.0, 0.0), stood, index * TENTH, 0.1)
    assert stays.yaw_variance < 0.1 * drove.yaw_variance
    assert stays.position_variance == 0.0


def test_reset_goes_back_to_the_start():
    odometer = Odometer()
    first = odometer.update(step(0.1, 0.1), gone(1.0), TENTH, 0.1)
    odometer.update(step(0.1, 0.2), gone(1.0), 2 * TENTH, 0.1)
    odometer.reset()
    assert odometer.update(step(0.1, 0.1), gone(1.0), TENTH, 0.1) == first


def test_a_rate_is_the_less_sure_the_longer_nothing_is_measured():
    odometer, deviations = Odometer(), []
    for pair in range(1, 31):
        found = odometer.update(
            HeadingStep(0.0, 0.0, 0.0, True), Travel(1.0, 0.01, TravelState.BRIDGED),
            pair * TENTH, 0.1)
        deviations.append(math.degrees(math.sqrt(found.yaw_rate_variance)))
    # A car begins a corner with 20 degrees per second squared, and has at most 30 per second.
    assert np.diff(deviations[:10]) == pytest.approx([2.0] * 9)
    assert deviations[-1] == pytest.approx(30.0)
    # A measured pair ends it.
    odometer.update(step(0.0, 0.0), gone(1.0), 31 * TENTH, 0.1)
    again = odometer.update(HeadingStep(0.0, 0.0, 0.0, True), gone(1.0), 32 * TENTH, 0.1)
    assert math.degrees(math.sqrt(again.yaw_rate_variance)) == pytest.approx(deviations[0])


@pytest.mark.parametrize('interval', [0.05, 0.5, 2.0])
def test_the_rate_of_a_bridged_pair_is_its_yaw_over_its_time(interval):
    """The heading went on at 0.2 rad/s; the tracker's own rate may differ, which is uncertain."""
    def rate(tracked):
        step = HeadingStep(0.2 * interval, tracked, 0.2 * interval, True)
        travel = Travel(1.0, 0.01, TravelState.BRIDGED)
        found = Odometer().update(step, travel, S, interval)
        return found.yaw_rate, found.yaw_rate_variance

    (same, sure), (other, unsure) = rate(0.2), rate(0.5)
    assert same == other == pytest.approx(0.2)
    assert unsure == pytest.approx(sure + 0.3 ** 2)
    assert math.radians(5.0) ** 2 < sure <= math.radians(30.0) ** 2
